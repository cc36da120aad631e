SET statement_timeout = 0;
SET lock_timeout = 0;
SET idle_in_transaction_session_timeout = 0;
SET client_encoding = 'UTF8';
SET standard_conforming_strings = on;
SELECT pg_catalog.set_config('search_path', '', false);
SET check_function_bodies = false;
SET xmloption = content;
SET client_min_messages = warning;
SET row_security = off;
CREATE SCHEMA dbos;
CREATE FUNCTION dbos.enqueue_workflow(workflow_name text, queue_name text, positional_args json[] DEFAULT ARRAY[]::json[], named_args json DEFAULT '{}'::json, class_name text DEFAULT NULL::text, config_name text DEFAULT NULL::text, workflow_id text DEFAULT NULL::text, app_version text DEFAULT NULL::text, timeout_ms bigint DEFAULT NULL::bigint, deadline_epoch_ms bigint DEFAULT NULL::bigint, deduplication_id text DEFAULT NULL::text, priority integer DEFAULT NULL::integer, queue_partition_key text DEFAULT NULL::text, authenticated_user text DEFAULT NULL::text, authenticated_roles text DEFAULT NULL::text, delay_until_epoch_ms bigint DEFAULT NULL::bigint, application_name text DEFAULT NULL::text) RETURNS text
    LANGUAGE plpgsql
    SET search_path TO 'pg_catalog', 'pg_temp'
    AS $$
DECLARE
    v_workflow_id TEXT;
    v_serialized_inputs TEXT;
    v_owner_xid TEXT;
    v_now BIGINT;
    v_recovery_attempts INT4 := 0;
    v_priority INT4;
    v_status TEXT;
BEGIN
    -- Validate required parameters
    IF workflow_name IS NULL OR workflow_name = '' THEN
        RAISE EXCEPTION 'Workflow name cannot be null or empty';
    END IF;
    IF queue_name IS NULL OR queue_name = '' THEN
        RAISE EXCEPTION 'Queue name cannot be null or empty';
    END IF;
    IF named_args IS NOT NULL AND jsonb_typeof(named_args::jsonb) != 'object' THEN
        RAISE EXCEPTION 'Named args must be a JSON object';
    END IF;
    IF workflow_id IS NOT NULL AND workflow_id = '' THEN
        RAISE EXCEPTION 'Workflow ID cannot be an empty string if provided.';
    END IF;
    IF delay_until_epoch_ms IS NOT NULL AND delay_until_epoch_ms < 0 THEN
        RAISE EXCEPTION 'delay_until_epoch_ms must be >= 0';
    END IF;
    v_workflow_id := COALESCE(workflow_id, gen_random_uuid()::TEXT);
    v_owner_xid := gen_random_uuid()::TEXT;
    v_priority := COALESCE(priority, 0);
    v_serialized_inputs := json_build_object(
        'positionalArgs', positional_args,
        'namedArgs', named_args
    )::TEXT;
    v_now := EXTRACT(epoch FROM now()) * 1000;
    v_status := CASE WHEN delay_until_epoch_ms IS NULL THEN 'ENQUEUED' ELSE 'DELAYED' END;
    INSERT INTO "dbos".workflow_status (
        workflow_uuid, status,
        name, class_name, config_name,
        queue_name, deduplication_id, priority, queue_partition_key,
        application_version,
        created_at, updated_at, recovery_attempts,
        workflow_timeout_ms, workflow_deadline_epoch_ms,
        parent_workflow_id, owner_xid, serialization,
        authenticated_user, authenticated_roles,
        delay_until_epoch_ms, application_name
    ) VALUES (
        v_workflow_id, v_status,
        workflow_name, class_name, config_name,
        queue_name, deduplication_id, v_priority, queue_partition_key,
        app_version,
        v_now, v_now, v_recovery_attempts,
        timeout_ms, deadline_epoch_ms,
        NULL, v_owner_xid, 'portable_json',
        authenticated_user, authenticated_roles,
        delay_until_epoch_ms, application_name
    )
    ON CONFLICT (workflow_uuid)
    DO UPDATE SET
        updated_at = EXCLUDED.updated_at;
    INSERT INTO "dbos".workflow_input (
        workflow_uuid, inputs, retention_timestamp
    ) VALUES (
        v_workflow_id, v_serialized_inputs, v_now
    )
    ON CONFLICT (workflow_uuid) DO NOTHING;
    RETURN v_workflow_id;
EXCEPTION
    WHEN unique_violation THEN
        RAISE EXCEPTION 'DBOS queue duplicated'
            USING DETAIL = format('Workflow %s with queue %s and deduplication ID %s already exists', v_workflow_id, queue_name, deduplication_id),
                ERRCODE = 'unique_violation';
END;
$$;
CREATE FUNCTION dbos.notifications_function() RETURNS trigger
    LANGUAGE plpgsql
    SET search_path TO 'pg_catalog', 'pg_temp'
    AS $$
DECLARE
    payload text := NEW.destination_uuid || '::' || NEW.topic;
BEGIN
    PERFORM pg_notify('dbos_notifications_channel', payload);
    RETURN NEW;
END;
$$;
CREATE FUNCTION dbos.send_message(destination_id text, message json, topic text DEFAULT NULL::text, message_id text DEFAULT NULL::text) RETURNS void
    LANGUAGE plpgsql
    SET search_path TO 'pg_catalog', 'pg_temp'
    AS $$
DECLARE
    v_topic TEXT := COALESCE(topic, '__null__topic__');
    v_message_id TEXT := COALESCE(message_id, gen_random_uuid()::TEXT);
BEGIN
    INSERT INTO "dbos".notifications (
        destination_uuid, topic, message, message_uuid, serialization
    ) VALUES (
        destination_id, v_topic, message, v_message_id, 'portable_json'
    )
    ON CONFLICT (message_uuid) DO NOTHING;
EXCEPTION
    WHEN foreign_key_violation THEN
        RAISE EXCEPTION 'DBOS non-existent workflow'
            USING DETAIL = format('Destination workflow %s does not exist', destination_id),
                ERRCODE = 'foreign_key_violation';
END;
$$;
SET default_tablespace = '';
SET default_table_access_method = heap;
CREATE TABLE dbos.application_versions (
    version_id text NOT NULL,
    version_name text NOT NULL,
    version_timestamp bigint DEFAULT ((EXTRACT(epoch FROM now()) * 1000.0))::bigint NOT NULL,
    created_at bigint DEFAULT ((EXTRACT(epoch FROM now()) * 1000.0))::bigint NOT NULL,
    application_name text
);
CREATE TABLE dbos.dbos_migrations (
    version bigint NOT NULL
);
CREATE TABLE dbos.event_dispatch_kv (
    service_name text NOT NULL,
    workflow_fn_name text NOT NULL,
    key text NOT NULL,
    value text,
    update_seq numeric(38,0),
    update_time numeric(38,15)
);
CREATE TABLE dbos.notifications (
    message_uuid text DEFAULT gen_random_uuid() NOT NULL,
    destination_uuid text NOT NULL,
    topic text,
    message text NOT NULL,
    created_at_epoch_ms bigint DEFAULT ((EXTRACT(epoch FROM now()) * 1000.0))::bigint NOT NULL,
    serialization text,
    consumed boolean DEFAULT false NOT NULL,
    consumed_by_function_id integer
);
CREATE TABLE dbos.operation_outputs (
    workflow_uuid text NOT NULL,
    function_id integer NOT NULL,
    function_name text DEFAULT ''::text NOT NULL,
    output text,
    error text,
    child_workflow_id text,
    started_at_epoch_ms bigint,
    completed_at_epoch_ms bigint,
    serialization text,
    application_name text,
    retention_timestamp bigint DEFAULT ((EXTRACT(epoch FROM now()) * 1000.0))::bigint NOT NULL
);
CREATE TABLE dbos.queues (
    queue_id text DEFAULT (gen_random_uuid())::text NOT NULL,
    name text NOT NULL,
    concurrency integer,
    worker_concurrency integer,
    rate_limit_max integer,
    rate_limit_period_sec double precision,
    priority_enabled boolean DEFAULT false NOT NULL,
    partition_queue boolean DEFAULT false NOT NULL,
    polling_interval_sec double precision DEFAULT 1.0 NOT NULL,
    created_at bigint DEFAULT ((EXTRACT(epoch FROM now()) * 1000.0))::bigint NOT NULL,
    updated_at bigint DEFAULT ((EXTRACT(epoch FROM now()) * 1000.0))::bigint NOT NULL,
    application_name text,
    partition_concurrency integer,
    partition_worker_concurrency integer,
    partition_rate_limit_max integer,
    partition_rate_limit_period_sec double precision
);
CREATE TABLE dbos.streams (
    workflow_uuid text NOT NULL,
    key text NOT NULL,
    value text NOT NULL,
    "offset" integer NOT NULL,
    function_id integer DEFAULT 0 NOT NULL,
    serialization text
);
CREATE TABLE dbos.workflow_events (
    workflow_uuid text NOT NULL,
    key text NOT NULL,
    value text NOT NULL,
    serialization text
);
CREATE TABLE dbos.workflow_events_history (
    workflow_uuid text NOT NULL,
    function_id integer NOT NULL,
    key text NOT NULL,
    value text NOT NULL,
    serialization text
);
CREATE TABLE dbos.workflow_input (
    workflow_uuid text NOT NULL,
    inputs text,
    retention_timestamp bigint DEFAULT ((EXTRACT(epoch FROM now()) * 1000.0))::bigint NOT NULL
);
CREATE TABLE dbos.workflow_output (
    workflow_uuid text NOT NULL,
    output text,
    error text,
    retention_timestamp bigint DEFAULT ((EXTRACT(epoch FROM now()) * 1000.0))::bigint NOT NULL
);
CREATE TABLE dbos.workflow_schedules (
    schedule_id text NOT NULL,
    schedule_name text NOT NULL,
    workflow_name text NOT NULL,
    workflow_class_name text,
    schedule text NOT NULL,
    status text DEFAULT 'ACTIVE'::text NOT NULL,
    context text NOT NULL,
    last_fired_at text,
    automatic_backfill boolean DEFAULT false NOT NULL,
    cron_timezone text,
    queue_name text,
    application_name text
);
CREATE TABLE dbos.workflow_status (
    workflow_uuid text NOT NULL,
    status text,
    name text,
    authenticated_user text,
    assumed_role text,
    authenticated_roles text,
    request text,
    output text,
    error text,
    executor_id text,
    created_at bigint DEFAULT ((EXTRACT(epoch FROM now()) * 1000.0))::bigint NOT NULL,
    updated_at bigint DEFAULT ((EXTRACT(epoch FROM now()) * 1000.0))::bigint NOT NULL,
    application_version text,
    application_id text,
    class_name character varying(255) DEFAULT NULL::character varying,
    config_name character varying(255) DEFAULT NULL::character varying,
    recovery_attempts bigint DEFAULT 0,
    queue_name text,
    workflow_timeout_ms bigint,
    workflow_deadline_epoch_ms bigint,
    inputs text,
    started_at_epoch_ms bigint,
    deduplication_id text,
    priority integer DEFAULT 0 NOT NULL,
    queue_partition_key text,
    forked_from text,
    owner_xid text,
    parent_workflow_id text,
    serialization text,
    delay_until_epoch_ms bigint,
    was_forked_from boolean DEFAULT false NOT NULL,
    rate_limited boolean DEFAULT false NOT NULL,
    completed_at bigint,
    attributes jsonb,
    schedule_name text,
    debounce_deadline_epoch_ms bigint,
    is_debounced boolean DEFAULT false NOT NULL,
    application_name text,
    creator_xid text
);
CREATE TABLE public.alarms (
    venue character varying(64) NOT NULL,
    rule character varying(32) NOT NULL,
    camera character varying(64) NOT NULL,
    since timestamp with time zone NOT NULL,
    why character varying(500) NOT NULL
);
CREATE TABLE public.api_keys (
    name character varying(64) NOT NULL,
    hash character varying(64) NOT NULL,
    scope character varying(16) NOT NULL,
    created_at timestamp with time zone NOT NULL,
    expires_at timestamp with time zone,
    last_used_at timestamp with time zone,
    venues json
);
CREATE TABLE public.camera_anchors (
    venue character varying(64) NOT NULL,
    camera character varying(64) NOT NULL,
    revision integer NOT NULL,
    at timestamp with time zone,
    posed json,
    baselines json NOT NULL,
    beyond boolean NOT NULL,
    moved_m double precision,
    cusum double precision,
    words character varying(500) NOT NULL
);
CREATE TABLE public.camera_trend (
    id integer NOT NULL,
    venue character varying(64) NOT NULL,
    camera character varying(64) NOT NULL,
    anchor integer NOT NULL,
    revision integer NOT NULL,
    job character varying(26) NOT NULL,
    at timestamp with time zone NOT NULL,
    across_m double precision NOT NULL,
    away_m double precision NOT NULL,
    sigma_across_m double precision NOT NULL,
    sigma_away_m double precision NOT NULL,
    repeatability_across_m double precision NOT NULL,
    repeatability_away_m double precision NOT NULL,
    rotation_deg double precision NOT NULL,
    sigma_rotation_deg double precision,
    position_m double precision NOT NULL,
    sigma_position_m double precision,
    focal_length double precision,
    sigma_focal_length double precision,
    focal_length_m double precision NOT NULL
);
CREATE SEQUENCE public.camera_trend_id_seq
    AS integer
    START WITH 1
    INCREMENT BY 1
    NO MINVALUE
    NO MAXVALUE
    CACHE 1;
ALTER SEQUENCE public.camera_trend_id_seq OWNED BY public.camera_trend.id;
CREATE TABLE public.credentials (
    venue character varying(64) NOT NULL,
    camera character varying(64) NOT NULL,
    userinfo character varying(1024) NOT NULL
);
CREATE TABLE public.deliveries (
    id character varying(26) NOT NULL,
    url character varying(2048) NOT NULL,
    receiver character varying(255) NOT NULL,
    status character varying(16) NOT NULL,
    attempts integer NOT NULL,
    due_at timestamp with time zone NOT NULL,
    last_error character varying(500),
    event bigint
);
CREATE TABLE public.esc_schema (
    version_num character varying(32) NOT NULL
);
CREATE TABLE public.events (
    id bigint NOT NULL,
    venue character varying(64) NOT NULL,
    type character varying(32) NOT NULL,
    at timestamp with time zone NOT NULL,
    data json,
    job character varying(26),
    asked_by character varying(80),
    address character varying(64),
    request_id character varying(64)
);
CREATE SEQUENCE public.events_id_seq
    START WITH 1
    INCREMENT BY 1
    NO MINVALUE
    NO MAXVALUE
    CACHE 1;
ALTER SEQUENCE public.events_id_seq OWNED BY public.events.id;
CREATE TABLE public.jobs (
    id character varying(26) NOT NULL,
    kind character varying(16) DEFAULT 'calibration'::character varying NOT NULL,
    venue character varying(64),
    status character varying(16) NOT NULL,
    priority integer NOT NULL,
    options json NOT NULL,
    content_hash character varying(64) NOT NULL,
    idempotency_key character varying(255),
    venue_document json NOT NULL,
    frames json NOT NULL,
    attempt integer NOT NULL,
    run_token character varying(32),
    revision integer NOT NULL,
    progress json,
    result json,
    pictures json,
    error json,
    created_at timestamp with time zone NOT NULL,
    started_at timestamp with time zone,
    finished_at timestamp with time zone,
    updated_at timestamp with time zone NOT NULL,
    frames_deleted_at timestamp with time zone,
    pictures_deleted_at timestamp with time zone,
    asked_by character varying(80),
    request_id character varying(64),
    traceparent character varying(55),
    venue_additions json,
    result_additions json,
    address character varying(64),
    site json
);
CREATE TABLE public.leftovers (
    folder character varying(255) NOT NULL,
    due_at timestamp with time zone NOT NULL
);
CREATE TABLE public.live_minutes (
    venue character varying(64) NOT NULL,
    minute timestamp with time zone NOT NULL,
    cameras json NOT NULL
);
CREATE TABLE public.live_reports (
    venue character varying(64) NOT NULL,
    reported_at timestamp with time zone NOT NULL,
    document json NOT NULL,
    watched json NOT NULL,
    alarm_due_at timestamp with time zone
);
CREATE TABLE public.memories (
    venue character varying(64) NOT NULL,
    revision integer NOT NULL,
    document json NOT NULL
);
CREATE TABLE public.revisions (
    id integer NOT NULL,
    venue character varying(64) NOT NULL,
    number integer NOT NULL,
    at timestamp with time zone NOT NULL,
    cause character varying(16) NOT NULL,
    job character varying(26),
    restored_from integer,
    stitch_error_px double precision,
    cameras json NOT NULL,
    ridge json NOT NULL,
    movements json NOT NULL,
    asked_by character varying(80),
    address character varying(64),
    request_id character varying(64),
    field_numbers json
);
CREATE SEQUENCE public.revisions_id_seq
    AS integer
    START WITH 1
    INCREMENT BY 1
    NO MINVALUE
    NO MAXVALUE
    CACHE 1;
ALTER SEQUENCE public.revisions_id_seq OWNED BY public.revisions.id;
CREATE TABLE public.schedules (
    venue character varying(64) NOT NULL,
    cron character varying(100) NOT NULL,
    time_zone character varying(64) NOT NULL,
    exact boolean NOT NULL,
    due_at timestamp with time zone NOT NULL,
    look_at timestamp with time zone NOT NULL,
    last_at timestamp with time zone,
    last_job character varying(26),
    last_error character varying(500),
    claimed_until timestamp with time zone,
    failures integer DEFAULT 0 NOT NULL,
    slow boolean DEFAULT false NOT NULL
);
CREATE TABLE public.sessions (
    hash character varying(64) NOT NULL,
    key_hash character varying(64) NOT NULL,
    expires_at timestamp with time zone NOT NULL
);
CREATE TABLE public.tallies (
    metric character varying(64) NOT NULL,
    labels character varying(255) NOT NULL,
    value double precision NOT NULL
);
CREATE TABLE public.venue_quality (
    venue character varying(64) NOT NULL,
    stitch_error_px double precision,
    moved_px double precision,
    accepted_at timestamp with time zone,
    drift_px double precision,
    rejected_in_a_row integer DEFAULT 0 NOT NULL,
    cameras json,
    glance json,
    alarm_due_at timestamp with time zone
);
CREATE TABLE public.venues (
    id character varying(64) NOT NULL,
    document json NOT NULL,
    updated_at timestamp with time zone NOT NULL,
    additions json
);
CREATE TABLE public.workers (
    name character varying(255) NOT NULL,
    model_sha256 character varying(64),
    started_at timestamp with time zone NOT NULL,
    seen_at timestamp with time zone NOT NULL,
    token character varying(32),
    place character varying(64),
    version character varying(64),
    unreadable_jobs integer
);
ALTER TABLE ONLY public.camera_trend ALTER COLUMN id SET DEFAULT nextval('public.camera_trend_id_seq'::regclass);
ALTER TABLE ONLY public.events ALTER COLUMN id SET DEFAULT nextval('public.events_id_seq'::regclass);
ALTER TABLE ONLY public.revisions ALTER COLUMN id SET DEFAULT nextval('public.revisions_id_seq'::regclass);
INSERT INTO dbos.application_versions VALUES ('1a012d7c-533a-464a-9fd7-e734cc3bc0c3', '1', 1795752356194, 1795752356194, 'esc');
INSERT INTO dbos.dbos_migrations VALUES (125);
INSERT INTO dbos.queues VALUES ('a04cb43c-e758-457f-b3a8-e9d9ddb4cfe6', 'calibration', NULL, 1, NULL, NULL, true, false, 0.5, 1795752356271, 1795752356241, 'esc', NULL, NULL, NULL, NULL);
INSERT INTO dbos.queues VALUES ('e55e0b47-7547-41cd-a583-7975e359b54c', 'light', NULL, 1, NULL, NULL, true, false, 0.5, 1795752356288, 1795752356287, 'esc', NULL, NULL, NULL, NULL);
INSERT INTO dbos.queues VALUES ('215c77d0-2096-4b97-8fd6-7e5fe33fbaf9', 'search', NULL, 1, NULL, NULL, true, false, 0.5, 1795752356304, 1795752356303, 'esc', NULL, NULL, NULL, NULL);
INSERT INTO dbos.workflow_input VALUES ('01M8DJWW30GY62AEMFQTSVX516', 'gASVNgAAAAAAAAB9lCiMBGFyZ3OUjBowMU04REpXVzMwR1k2MkFFTUZRVFNWWDUxNpSFlIwGa3dhcmdzlH2UdS4=', 1795752358026);
INSERT INTO dbos.workflow_input VALUES ('01M8DJWYA057W0MVSJPJ78RF4T', 'gASVNgAAAAAAAAB9lCiMBGFyZ3OUjBowMU04REpXWUEwNTdXME1WU0pQSjc4UkY0VJSFlIwGa3dhcmdzlH2UdS4=', 1795752360278);
INSERT INTO dbos.workflow_input VALUES ('01M8DJWZAQKH0A39ZWEFVQHFMP', 'gASVNgAAAAAAAAB9lCiMBGFyZ3OUjBowMU04REpXWkFRS0gwQTM5WldFRlZRSEZNUJSFlIwGa3dhcmdzlH2UdS4=', 1795752361323);
INSERT INTO dbos.workflow_input VALUES ('01M8DJX04439TYSYCC0VWFT25G', 'gASVNgAAAAAAAAB9lCiMBGFyZ3OUjBowMU04REpYMDQ0MzlUWVNZQ0MwVldGVDI1R5SFlIwGa3dhcmdzlH2UdS4=', 1795752362140);
INSERT INTO dbos.workflow_input VALUES ('01M8DJX12NZQB83XX9NA7SW1SB', 'gASVNgAAAAAAAAB9lCiMBGFyZ3OUjBowMU04REpYMTJOWlFCODNYWDlOQTdTVzFTQpSFlIwGa3dhcmdzlH2UdS4=', 1795752363106);
INSERT INTO dbos.workflow_input VALUES ('01M8DJX1B9TPHVCW82SFCG4BC6', 'gASVNgAAAAAAAAB9lCiMBGFyZ3OUjBowMU04REpYMUI5VFBIVkNXODJTRkNHNEJDNpSFlIwGa3dhcmdzlH2UdS4=', 1795752363382);
INSERT INTO dbos.workflow_input VALUES ('01M8DJX26QQMBWQ1Q4D8YDTW9D', 'gASVNgAAAAAAAAB9lCiMBGFyZ3OUjBowMU04REpYMjZRUU1CV1ExUTREOFlEVFc5RJSFlIwGa3dhcmdzlH2UdS4=', 1795752364268);
INSERT INTO dbos.workflow_input VALUES ('01M8DJX3AF6NNCVEJTCVWA0VQ8', 'gASVNgAAAAAAAAB9lCiMBGFyZ3OUjBowMU04REpYM0FGNk5OQ1ZFSlRDVldBMFZROJSFlIwGa3dhcmdzlH2UdS4=', 1795752365420);
INSERT INTO dbos.workflow_input VALUES ('01M8DJX42JP4DTW4VYZ5FZ2SE8', 'gASVNgAAAAAAAAB9lCiMBGFyZ3OUjBowMU04REpYNDJKUDREVFc0VllaNUZaMlNFOJSFlIwGa3dhcmdzlH2UdS4=', 1795752366165);
INSERT INTO dbos.workflow_input VALUES ('01M8DJX4J3KKF00YMKQPEM4WJZ', 'gASVNgAAAAAAAAB9lCiMBGFyZ3OUjBowMU04REpYNEozS0tGMDBZTUtRUEVNNFdKWpSFlIwGa3dhcmdzlH2UdS4=', 1795752366679);
INSERT INTO dbos.workflow_input VALUES ('01M8DJXV153Z1EDZ0N1GN8Q5JW', 'gASVNgAAAAAAAAB9lCiMBGFyZ3OUjBowMU04REpYVjE1M1oxRURaME4xR044UTVKV5SFlIwGa3dhcmdzlH2UdS4=', 1795752389721);
INSERT INTO dbos.workflow_input VALUES ('01M8DJXVCR0N7EED0CMV0FJMG9', 'gASVNgAAAAAAAAB9lCiMBGFyZ3OUjBowMU04REpYVkNSME43RUVEMENNVjBGSk1HOZSFlIwGa3dhcmdzlH2UdS4=', 1795752390080);
INSERT INTO dbos.workflow_output VALUES ('01M8DJWW30GY62AEMFQTSVX516', 'gAROLg==', NULL, 1795752360004);
INSERT INTO dbos.workflow_output VALUES ('01M8DJWYA057W0MVSJPJ78RF4T', 'gAROLg==', NULL, 1795752360897);
INSERT INTO dbos.workflow_output VALUES ('01M8DJWZAQKH0A39ZWEFVQHFMP', 'gAROLg==', NULL, 1795752361868);
INSERT INTO dbos.workflow_output VALUES ('01M8DJX04439TYSYCC0VWFT25G', 'gAROLg==', NULL, 1795752362824);
INSERT INTO dbos.workflow_output VALUES ('01M8DJX12NZQB83XX9NA7SW1SB', 'gAROLg==', NULL, 1795752363305);
INSERT INTO dbos.workflow_output VALUES ('01M8DJX1B9TPHVCW82SFCG4BC6', 'gAROLg==', NULL, 1795752364087);
INSERT INTO dbos.workflow_output VALUES ('01M8DJX26QQMBWQ1Q4D8YDTW9D', 'gAROLg==', NULL, 1795752365139);
INSERT INTO dbos.workflow_output VALUES ('01M8DJX3AF6NNCVEJTCVWA0VQ8', 'gAROLg==', NULL, 1795752365960);
INSERT INTO dbos.workflow_output VALUES ('01M8DJX42JP4DTW4VYZ5FZ2SE8', 'gAROLg==', NULL, 1795752366567);
INSERT INTO dbos.workflow_output VALUES ('01M8DJX4J3KKF00YMKQPEM4WJZ', 'gAROLg==', NULL, 1795752367015);
INSERT INTO dbos.workflow_status VALUES ('01M8DJWW30GY62AEMFQTSVX516', 'SUCCESS', 'calibrate', NULL, NULL, NULL, NULL, NULL, NULL, 'vm', 1795752358026, 1795752360004, '1', NULL, NULL, NULL, 1, 'calibration', NULL, NULL, NULL, 1795752358399, NULL, 100, NULL, NULL, NULL, NULL, 'py_pickle', NULL, false, false, 1795752360004, 'null', NULL, NULL, false, 'esc', 'f955a458-4a4e-4155-8030-3da9b09e766f');
INSERT INTO dbos.workflow_status VALUES ('01M8DJWYA057W0MVSJPJ78RF4T', 'SUCCESS', 'calibrate', NULL, NULL, NULL, NULL, NULL, NULL, 'vm', 1795752360278, 1795752360897, '1', NULL, NULL, NULL, 1, 'calibration', NULL, NULL, NULL, 1795752360576, NULL, 100, NULL, NULL, NULL, NULL, 'py_pickle', NULL, false, false, 1795752360897, 'null', NULL, NULL, false, 'esc', 'a1291755-d47b-4475-a36c-f324f3f29af6');
INSERT INTO dbos.workflow_status VALUES ('01M8DJWZAQKH0A39ZWEFVQHFMP', 'SUCCESS', 'calibrate', NULL, NULL, NULL, NULL, NULL, NULL, 'vm', 1795752361323, 1795752361868, '1', NULL, NULL, NULL, 1, 'calibration', NULL, NULL, NULL, 1795752361597, NULL, 100, NULL, NULL, NULL, NULL, 'py_pickle', NULL, false, false, 1795752361868, 'null', NULL, NULL, false, 'esc', 'df08e15d-f61b-4c24-a222-c6bc9f4c7dc4');
INSERT INTO dbos.workflow_status VALUES ('01M8DJX04439TYSYCC0VWFT25G', 'SUCCESS', 'calibrate', NULL, NULL, NULL, NULL, NULL, NULL, 'vm', 1795752362140, 1795752362824, '1', NULL, NULL, NULL, 1, 'calibration', NULL, NULL, NULL, 1795752362619, NULL, 100, NULL, NULL, NULL, NULL, 'py_pickle', NULL, false, false, 1795752362824, 'null', NULL, NULL, false, 'esc', 'dfb4b91f-2eb9-4431-9345-ba83956cfb67');
INSERT INTO dbos.workflow_status VALUES ('01M8DJX12NZQB83XX9NA7SW1SB', 'SUCCESS', 'calibrate', NULL, NULL, NULL, NULL, NULL, NULL, 'vm', 1795752363106, 1795752363305, '1', NULL, NULL, NULL, 1, 'calibration', NULL, NULL, NULL, 1795752363137, NULL, 100, NULL, NULL, NULL, NULL, 'py_pickle', NULL, false, false, 1795752363305, 'null', NULL, NULL, false, 'esc', '061b4f33-44a5-4cff-a14c-07329da49be5');
INSERT INTO dbos.workflow_status VALUES ('01M8DJX1B9TPHVCW82SFCG4BC6', 'SUCCESS', 'calibrate', NULL, NULL, NULL, NULL, NULL, NULL, 'vm', 1795752363382, 1795752364087, '1', NULL, NULL, NULL, 1, 'calibration', NULL, NULL, NULL, 1795752363659, NULL, 100, NULL, NULL, NULL, NULL, 'py_pickle', NULL, false, false, 1795752364087, 'null', NULL, NULL, false, 'esc', '489d3ec1-0545-402c-a368-565b03a8b938');
INSERT INTO dbos.workflow_status VALUES ('01M8DJX26QQMBWQ1Q4D8YDTW9D', 'SUCCESS', 'calibrate', NULL, NULL, NULL, NULL, NULL, NULL, 'vm', 1795752364268, 1795752365139, '1', NULL, NULL, NULL, 1, 'calibration', NULL, NULL, NULL, 1795752364700, NULL, 100, NULL, NULL, NULL, NULL, 'py_pickle', NULL, false, false, 1795752365139, 'null', NULL, NULL, false, 'esc', 'ae675f04-3036-454e-b7e5-2c578c812220');
INSERT INTO dbos.workflow_status VALUES ('01M8DJX3AF6NNCVEJTCVWA0VQ8', 'SUCCESS', 'calibrate', NULL, NULL, NULL, NULL, NULL, NULL, 'vm', 1795752365420, 1795752365960, '1', NULL, NULL, NULL, 1, 'calibration', NULL, NULL, NULL, 1795752365763, NULL, 100, NULL, NULL, NULL, NULL, 'py_pickle', NULL, false, false, 1795752365960, 'null', NULL, NULL, false, 'esc', '6b3745e8-c191-4f80-8315-b67f37040283');
INSERT INTO dbos.workflow_status VALUES ('01M8DJX42JP4DTW4VYZ5FZ2SE8', 'SUCCESS', 'calibrate', NULL, NULL, NULL, NULL, NULL, NULL, 'vm', 1795752366165, 1795752366567, '1', NULL, NULL, NULL, 1, 'light', NULL, NULL, NULL, 1795752366298, NULL, 100, NULL, NULL, NULL, NULL, 'py_pickle', NULL, false, false, 1795752366567, 'null', NULL, NULL, false, 'esc', '3965614a-e196-4fc3-837d-be8eaea2c137');
INSERT INTO dbos.workflow_status VALUES ('01M8DJX4J3KKF00YMKQPEM4WJZ', 'SUCCESS', 'calibrate', NULL, NULL, NULL, NULL, NULL, NULL, 'vm', 1795752366679, 1795752367015, '1', NULL, NULL, NULL, 1, 'search', NULL, NULL, NULL, 1795752366825, NULL, 100, NULL, NULL, NULL, NULL, 'py_pickle', NULL, false, false, 1795752367015, 'null', NULL, NULL, false, 'esc', '0ae5881f-d519-4032-b203-a3791d66130d');
INSERT INTO dbos.workflow_status VALUES ('01M8DJXV153Z1EDZ0N1GN8Q5JW', 'ENQUEUED', 'calibrate', NULL, NULL, NULL, NULL, NULL, NULL, NULL, 1795752389721, 1795752389721, NULL, NULL, NULL, NULL, 0, 'calibration', NULL, NULL, NULL, NULL, NULL, 100, NULL, NULL, NULL, NULL, 'py_pickle', NULL, false, false, NULL, 'null', NULL, NULL, false, 'esc', '71159980-8242-4f89-bb23-fe22801fbebc');
INSERT INTO dbos.workflow_status VALUES ('01M8DJXVCR0N7EED0CMV0FJMG9', 'ENQUEUED', 'calibrate', NULL, NULL, NULL, NULL, NULL, NULL, NULL, 1795752390080, 1795752390080, NULL, NULL, NULL, NULL, 0, 'calibration', NULL, NULL, NULL, NULL, NULL, 100, NULL, NULL, NULL, NULL, 'py_pickle', NULL, false, false, NULL, 'null', NULL, NULL, false, 'esc', 'aa521235-bd4e-4be8-b916-3896f9a35d6b');
INSERT INTO public.camera_anchors VALUES ('everything', 'left', 1, NULL, NULL, '{}', false, NULL, NULL, 'Camera left has had no pose accepted since it was put.');
INSERT INTO public.camera_anchors VALUES ('everything', 'right', 1, NULL, NULL, '{}', false, NULL, NULL, 'Camera right has had no pose accepted since it was put.');
INSERT INTO public.camera_anchors VALUES ('reject', 'left', 1, NULL, NULL, '{}', false, NULL, NULL, 'Camera left has had no pose accepted since it was put.');
INSERT INTO public.camera_anchors VALUES ('reject', 'right', 1, NULL, NULL, '{}', false, NULL, NULL, 'Camera right has had no pose accepted since it was put.');
INSERT INTO public.camera_anchors VALUES ('partly', 'left', 1, NULL, NULL, '{}', false, NULL, NULL, 'Camera left has had no pose accepted since it was put.');
INSERT INTO public.camera_anchors VALUES ('partly', 'right', 1, NULL, NULL, '{}', false, NULL, NULL, 'Camera right has had no pose accepted since it was put.');
INSERT INTO public.camera_anchors VALUES ('fail', 'left', 1, NULL, NULL, '{}', false, NULL, NULL, 'Camera left has had no pose accepted since it was put.');
INSERT INTO public.camera_anchors VALUES ('fail', 'right', 1, NULL, NULL, '{}', false, NULL, NULL, 'Camera right has had no pose accepted since it was put.');
INSERT INTO public.camera_anchors VALUES ('knock', 'right', 1, NULL, NULL, '{}', false, NULL, NULL, 'Camera right has had no pose accepted since it was put.');
INSERT INTO public.camera_anchors VALUES ('knock', 'left', 1, '2026-11-27 04:06:04.002956+00', '{"id": "left", "image_size": [64, 48], "intrinsics": {"matrix": [[60.0, 0.0, 32.0], [0.0, 60.0, 24.0], [0.0, 0.0, 1.0]], "distortion": []}, "pose": {"rotation": [1.6, 0.1, -0.2], "position": [-0.875, -43.75, 7.0], "translation": [9.533936782629521, 5.147378463023262, 42.97018349254782]}}', '{}', false, 0, 0, 'Camera left: too few nights to judge by (1 of 4).');
INSERT INTO public.camera_anchors VALUES ('contradict', 'left', 1, '2026-11-27 04:06:05.015394+00', '{"id": "left", "image_size": [64, 48], "intrinsics": {"matrix": [[60.0, 0.0, 32.0], [0.0, 60.0, 24.0], [0.0, 0.0, 1.0]], "distortion": []}, "pose": {"rotation": [1.6, 0.1, -0.2], "position": [-0.875, -43.75, 7.0], "translation": [9.533936782629521, 5.147378463023262, 42.97018349254782]}}', '{}', false, 0, 0, 'Camera left: too few nights to judge by (1 of 4).');
INSERT INTO public.camera_anchors VALUES ('contradict', 'right', 1, '2026-11-27 04:06:05.015394+00', '{"id": "right", "image_size": [64, 48], "intrinsics": {"matrix": [[60.0, 0.0, 32.0], [0.0, 60.0, 24.0], [0.0, 0.0, 1.0]], "distortion": []}, "pose": {"rotation": [1.6, 0.1, -0.2], "position": [-0.875, -43.75, 7.0], "translation": [9.533936782629521, 5.147378463023262, 42.97018349254782]}}', '{}', false, 0, 0, 'Camera right: too few nights to judge by (1 of 4).');
INSERT INTO public.camera_anchors VALUES ('waiting', 'left', 1, NULL, NULL, '{}', false, NULL, NULL, 'Camera left has had no pose accepted since it was put.');
INSERT INTO public.camera_anchors VALUES ('waiting', 'right', 1, NULL, NULL, '{}', false, NULL, NULL, 'Camera right has had no pose accepted since it was put.');
INSERT INTO public.camera_anchors VALUES ('cancelled', 'left', 1, NULL, NULL, '{}', false, NULL, NULL, 'Camera left has had no pose accepted since it was put.');
INSERT INTO public.camera_anchors VALUES ('cancelled', 'right', 1, NULL, NULL, '{}', false, NULL, NULL, 'Camera right has had no pose accepted since it was put.');
INSERT INTO public.camera_trend VALUES (5, 'knock', 'left', 1, 2, '01M8DJX1B9TPHVCW82SFCG4BC6', '2026-11-27 04:06:04.002956+00', 0, 0, 0.01, 0.02, 0.005, 0.01, 0, NULL, 0, NULL, 0.0001, 0.0002, 60);
INSERT INTO public.camera_trend VALUES (6, 'contradict', 'left', 1, 2, '01M8DJX26QQMBWQ1Q4D8YDTW9D', '2026-11-27 04:06:05.015394+00', 0, 0, 0.01, 0.02, 0.005, 0.01, 0, NULL, 0, NULL, 0.0001, 0.0002, 60);
INSERT INTO public.camera_trend VALUES (7, 'contradict', 'right', 1, 2, '01M8DJX26QQMBWQ1Q4D8YDTW9D', '2026-11-27 04:06:05.015394+00', 0, 0, 0.01, 0.02, 0.005, 0.01, 0, NULL, 0, NULL, 0.0001, 0.0002, 60);
INSERT INTO public.credentials VALUES ('everything', 'left', 'u:p');
INSERT INTO public.deliveries VALUES ('01M8DJWYWMPTG7RX97ZWDB8AHX', 'https://example.com/told', 'example.com', 'waiting', 1, '2026-11-27 04:06:07.870382+00', 'example.com cannot be looked up: [Errno -2] Name or service not known', 7);
INSERT INTO public.deliveries VALUES ('01M8DJWZ5SJ8PD6KPDAQGGEVNJ', 'https://example.com/told', 'example.com', 'waiting', 1, '2026-11-27 04:06:07.647984+00', 'example.com cannot be looked up: [Errno -2] Name or service not known', 9);
INSERT INTO public.deliveries VALUES ('01M8DJWVZTJW46DJGNVH2SHNPY', 'https://example.com/told', 'example.com', 'waiting', 2, '2026-11-27 04:06:34.668338+00', 'example.com cannot be looked up: [Errno -2] Name or service not known', 2);
INSERT INTO public.deliveries VALUES ('01M8DJWVT3P9C8K9F4PKCRKY63', 'https://example.com/told', 'example.com', 'waiting', 2, '2026-11-27 04:06:34.81038+00', 'example.com cannot be looked up: [Errno -2] Name or service not known', 1);
INSERT INTO public.deliveries VALUES ('01M8DJWW30GY62AEMFQTSVX516', 'https://example.com/end', 'example.com', 'waiting', 2, '2026-11-27 04:06:38.478108+00', 'example.com cannot be looked up: [Errno -2] Name or service not known', NULL);
INSERT INTO public.deliveries VALUES ('01M8DJWXYAK08ASPAPMA6XAKR3', 'https://example.com/told', 'example.com', 'waiting', 2, '2026-11-27 04:06:37.060144+00', 'example.com cannot be looked up: [Errno -2] Name or service not known', 4);
INSERT INTO public.esc_schema VALUES ('0009');
INSERT INTO public.events VALUES (1, 'everything', 'venue.created', '2026-11-27 04:05:57.694495+00', '{"venue": "everything", "changed": []}', NULL, 'anyone', '127.0.0.1', '4738f054e2194cb29ffd16adb9975a7e');
INSERT INTO public.events VALUES (2, 'everything', 'poses.changed', '2026-11-27 04:05:57.709688+00', '{"venue": "everything", "revision": 1, "cause": "put", "job": null, "stitch_error_px": null, "ridge": [[-18.5, 0.0, 0.2], [18.5, 0.0, 0.2]], "cameras": [{"id": "left", "image_size": [64, 48], "intrinsics": {"model": "opencv", "matrix": [[60.0, 0.0, 32.0], [0.0, 60.0, 24.0], [0.0, 0.0, 1.0]], "distortion": [], "sigma": null, "sigma_from": null}, "pose": {"rotation": [1.6, 0.1, -0.2], "position": [-1.0, -50.0, 8.0], "translation": [10.895927751576597, 5.882718243455158, 49.10878113434035]}}, {"id": "right", "image_size": [64, 48], "intrinsics": {"model": "opencv", "matrix": [[60.0, 0.0, 32.0], [0.0, 60.0, 24.0], [0.0, 0.0, 1.0]], "distortion": [], "sigma": {"fx": 0.5}, "sigma_from": null}, "pose": {"rotation": [1.6, 0.1, -0.2], "position": [-1.0, -50.0, 8.0], "translation": [10.895927751576597, 5.882718243455158, 49.10878113434035]}}], "changed": ["left", "right"]}', NULL, 'anyone', '127.0.0.1', '4738f054e2194cb29ffd16adb9975a7e');
INSERT INTO public.events VALUES (3, 'everything', 'job.queued', '2026-11-27 04:05:58.032664+00', '{"id": "01M8DJWW30GY62AEMFQTSVX516", "kind": "calibration", "venue": "everything", "status": "queued", "progress": null, "queue_position": 1, "attempt": 0, "created_at": "2026-11-27T04:05:58.032664Z", "started_at": null, "finished_at": null, "error": null, "result": null, "venue_revision": null, "asked_by": null, "options": {"priority": "routine", "timeout_s": null, "preset": "esc", "search": "auto", "seed": 1641036203, "generations": 100, "parents": 64, "offspring": 128, "stitch_weight": 0.5, "flat": false, "fit_focal_length": false, "fit_ridge": false, "dry_run": false, "pictures": false}, "frames": {"left": ["/jobs/01M8DJWW30GY62AEMFQTSVX516/frames/0"], "right": ["/jobs/01M8DJWW30GY62AEMFQTSVX516/frames/1"]}, "links": {"self": "/jobs/01M8DJWW30GY62AEMFQTSVX516", "events": "/jobs/01M8DJWW30GY62AEMFQTSVX516/events", "cancel": "/jobs/01M8DJWW30GY62AEMFQTSVX516/cancel", "venue": "/venues/everything"}}', '01M8DJWW30GY62AEMFQTSVX516', 'anyone', '127.0.0.1', '6777b76bc8d340eb941cbd6cc03a64dc');
INSERT INTO public.events VALUES (4, 'everything', 'poses.changed', '2026-11-27 04:05:59.706832+00', '{"venue": "everything", "revision": 2, "cause": "calibrated", "job": "01M8DJWW30GY62AEMFQTSVX516", "stitch_error_px": 0.2, "ridge": [[-18.5, 0.0, 0.2], [18.5, 0.0, 0.2]], "cameras": [{"id": "left", "image_size": [64, 48], "intrinsics": {"model": "opencv", "matrix": [[60.0, 0.0, 32.0], [0.0, 60.0, 24.0], [0.0, 0.0, 1.0]], "distortion": [], "sigma": null, "sigma_from": null}, "pose": {"rotation": [1.6, 0.1, -0.2], "position": [-0.875, -43.75, 7.0], "translation": [9.533936782629521, 5.147378463023262, 42.97018349254782]}}, {"id": "right", "image_size": [64, 48], "intrinsics": {"model": "opencv", "matrix": [[60.0, 0.0, 32.0], [0.0, 60.0, 24.0], [0.0, 0.0, 1.0]], "distortion": [], "sigma": {"fx": 0.5}, "sigma_from": null}, "pose": {"rotation": [1.6, 0.1, -0.2], "position": [-0.875, -43.75, 7.0], "translation": [9.533936782629521, 5.147378463023262, 42.97018349254782]}}], "changed": ["left", "right"]}', NULL, 'anyone', '127.0.0.1', '6777b76bc8d340eb941cbd6cc03a64dc');
INSERT INTO public.events VALUES (5, 'everything', 'job.succeeded', '2026-11-27 04:05:59.706832+00', NULL, '01M8DJWW30GY62AEMFQTSVX516', NULL, NULL, NULL);
INSERT INTO public.events VALUES (6, 'everything', 'job.queued', '2026-11-27 04:06:00.282891+00', '{"id": "01M8DJWYA057W0MVSJPJ78RF4T", "kind": "calibration", "venue": "everything", "status": "queued", "progress": null, "queue_position": 1, "attempt": 0, "created_at": "2026-11-27T04:06:00.282891Z", "started_at": null, "finished_at": null, "error": null, "result": null, "venue_revision": null, "asked_by": null, "options": {"priority": "routine", "timeout_s": null, "preset": "esc", "search": "auto", "seed": 1824516984, "generations": 100, "parents": 64, "offspring": 128, "stitch_weight": 0.5, "flat": true, "fit_focal_length": false, "fit_ridge": false, "dry_run": false, "pictures": false}, "frames": {"left": ["/jobs/01M8DJWYA057W0MVSJPJ78RF4T/frames/0"], "right": ["/jobs/01M8DJWYA057W0MVSJPJ78RF4T/frames/1"]}, "links": {"self": "/jobs/01M8DJWYA057W0MVSJPJ78RF4T", "events": "/jobs/01M8DJWYA057W0MVSJPJ78RF4T/events", "cancel": "/jobs/01M8DJWYA057W0MVSJPJ78RF4T/cancel", "venue": "/venues/everything"}}', '01M8DJWYA057W0MVSJPJ78RF4T', 'anyone', '127.0.0.1', '6c2ea00515314d6c88b7594f82607dac');
INSERT INTO public.events VALUES (7, 'everything', 'poses.changed', '2026-11-27 04:06:00.826721+00', '{"venue": "everything", "revision": 3, "cause": "calibrated", "job": "01M8DJWYA057W0MVSJPJ78RF4T", "stitch_error_px": 0.2, "ridge": [[-18.5, 0.0, 0.2], [18.5, 0.0, 0.2]], "cameras": [{"id": "left", "image_size": [64, 48], "intrinsics": {"model": "opencv", "matrix": [[60.0, 0.0, 32.0], [0.0, 60.0, 24.0], [0.0, 0.0, 1.0]], "distortion": [], "sigma": null, "sigma_from": null}, "pose": {"rotation": [1.6, 0.1, -0.2], "position": [-0.765625, -38.28125, 6.125], "translation": [8.34219468480083, 4.503956155145355, 37.59891055597933]}}, {"id": "right", "image_size": [64, 48], "intrinsics": {"model": "opencv", "matrix": [[60.0, 0.0, 32.0], [0.0, 60.0, 24.0], [0.0, 0.0, 1.0]], "distortion": [], "sigma": {"fx": 0.5}, "sigma_from": null}, "pose": {"rotation": [1.6, 0.1, -0.2], "position": [-0.765625, -38.28125, 6.125], "translation": [8.34219468480083, 4.503956155145355, 37.59891055597933]}}], "changed": ["left", "right"]}', NULL, 'anyone', '127.0.0.1', '6c2ea00515314d6c88b7594f82607dac');
INSERT INTO public.events VALUES (8, 'everything', 'job.succeeded', '2026-11-27 04:06:00.826721+00', NULL, '01M8DJWYA057W0MVSJPJ78RF4T', NULL, NULL, NULL);
INSERT INTO public.events VALUES (9, 'everything', 'poses.changed', '2026-11-27 04:06:01.025438+00', '{"venue": "everything", "revision": 4, "cause": "restored", "job": null, "stitch_error_px": null, "ridge": [[-18.5, 0.0, 0.2], [18.5, 0.0, 0.2]], "cameras": [{"id": "left", "image_size": [64, 48], "intrinsics": {"model": "opencv", "matrix": [[60.0, 0.0, 32.0], [0.0, 60.0, 24.0], [0.0, 0.0, 1.0]], "distortion": [], "sigma": null, "sigma_from": null}, "pose": {"rotation": [1.6, 0.1, -0.2], "position": [-1.0, -50.0, 8.0], "translation": [10.895927751576597, 5.882718243455158, 49.10878113434035]}}, {"id": "right", "image_size": [64, 48], "intrinsics": {"model": "opencv", "matrix": [[60.0, 0.0, 32.0], [0.0, 60.0, 24.0], [0.0, 0.0, 1.0]], "distortion": [], "sigma": {"fx": 0.5}, "sigma_from": null}, "pose": {"rotation": [1.6, 0.1, -0.2], "position": [-1.0, -50.0, 8.0], "translation": [10.895927751576597, 5.882718243455158, 49.10878113434035]}}], "changed": ["left", "right"]}', NULL, 'anyone', '127.0.0.1', '4b6cd88d51514bbabb38181c2c9cf386');
INSERT INTO public.events VALUES (10, 'reject', 'venue.created', '2026-11-27 04:06:01.236478+00', '{"venue": "reject", "changed": []}', NULL, 'anyone', '127.0.0.1', 'ae35ab148d0b48cd8e43a7b5e992df7a');
INSERT INTO public.events VALUES (11, 'reject', 'poses.changed', '2026-11-27 04:06:01.244741+00', '{"venue": "reject", "revision": 1, "cause": "put", "job": null, "stitch_error_px": null, "ridge": null, "cameras": [{"id": "left", "image_size": [64, 48], "intrinsics": {"model": "opencv", "matrix": [[60.0, 0.0, 32.0], [0.0, 60.0, 24.0], [0.0, 0.0, 1.0]], "distortion": [], "sigma": null, "sigma_from": null}, "pose": {"rotation": [1.6, 0.1, -0.2], "position": [-1.0, -50.0, 8.0], "translation": [10.895927751576597, 5.882718243455158, 49.10878113434035]}}, {"id": "right", "image_size": [64, 48], "intrinsics": {"model": "opencv", "matrix": [[60.0, 0.0, 32.0], [0.0, 60.0, 24.0], [0.0, 0.0, 1.0]], "distortion": [], "sigma": null, "sigma_from": null}, "pose": {"rotation": [1.6, 0.1, -0.2], "position": [-1.0, -50.0, 8.0], "translation": [10.895927751576597, 5.882718243455158, 49.10878113434035]}}], "changed": ["left", "right"]}', NULL, 'anyone', '127.0.0.1', 'ae35ab148d0b48cd8e43a7b5e992df7a');
INSERT INTO public.events VALUES (13, 'reject', 'job.succeeded', '2026-11-27 04:06:01.851813+00', NULL, '01M8DJWZAQKH0A39ZWEFVQHFMP', NULL, NULL, NULL);
INSERT INTO public.events VALUES (12, 'reject', 'job.queued', '2026-11-27 04:06:01.327809+00', '{"id": "01M8DJWZAQKH0A39ZWEFVQHFMP", "kind": "calibration", "venue": "reject", "status": "queued", "progress": null, "queue_position": 1, "attempt": 0, "created_at": "2026-11-27T04:06:01.327809Z", "started_at": null, "finished_at": null, "error": null, "result": null, "venue_revision": null, "asked_by": null, "options": {"priority": "routine", "timeout_s": null, "preset": "esc", "search": "auto", "seed": 1047423431, "generations": 100, "parents": 64, "offspring": 128, "stitch_weight": 0.5, "flat": false, "fit_focal_length": false, "fit_ridge": false, "dry_run": false, "pictures": false}, "frames": {"left": ["/jobs/01M8DJWZAQKH0A39ZWEFVQHFMP/frames/0"], "right": ["/jobs/01M8DJWZAQKH0A39ZWEFVQHFMP/frames/1"]}, "links": {"self": "/jobs/01M8DJWZAQKH0A39ZWEFVQHFMP", "events": "/jobs/01M8DJWZAQKH0A39ZWEFVQHFMP/events", "cancel": "/jobs/01M8DJWZAQKH0A39ZWEFVQHFMP/cancel", "venue": "/venues/reject"}}', '01M8DJWZAQKH0A39ZWEFVQHFMP', 'anyone', '127.0.0.1', 'b2dc499feec94d1da533714779c798ad');
INSERT INTO public.events VALUES (14, 'partly', 'venue.created', '2026-11-27 04:06:02.05276+00', '{"venue": "partly", "changed": []}', NULL, 'anyone', '127.0.0.1', '551dfb29aca944e399e18aa0ee7d181c');
INSERT INTO public.events VALUES (15, 'partly', 'poses.changed', '2026-11-27 04:06:02.055698+00', '{"venue": "partly", "revision": 1, "cause": "put", "job": null, "stitch_error_px": null, "ridge": null, "cameras": [{"id": "left", "image_size": [64, 48], "intrinsics": {"model": "opencv", "matrix": [[60.0, 0.0, 32.0], [0.0, 60.0, 24.0], [0.0, 0.0, 1.0]], "distortion": [], "sigma": null, "sigma_from": null}, "pose": {"rotation": [1.6, 0.1, -0.2], "position": [-1.0, -50.0, 8.0], "translation": [10.895927751576597, 5.882718243455158, 49.10878113434035]}}, {"id": "right", "image_size": [64, 48], "intrinsics": {"model": "opencv", "matrix": [[60.0, 0.0, 32.0], [0.0, 60.0, 24.0], [0.0, 0.0, 1.0]], "distortion": [], "sigma": null, "sigma_from": null}, "pose": {"rotation": [1.6, 0.1, -0.2], "position": [-1.0, -50.0, 8.0], "translation": [10.895927751576597, 5.882718243455158, 49.10878113434035]}}], "changed": ["left", "right"]}', NULL, 'anyone', '127.0.0.1', '551dfb29aca944e399e18aa0ee7d181c');
INSERT INTO public.events VALUES (16, 'partly', 'job.queued', '2026-11-27 04:06:02.144939+00', '{"id": "01M8DJX04439TYSYCC0VWFT25G", "kind": "calibration", "venue": "partly", "status": "queued", "progress": null, "queue_position": 1, "attempt": 0, "created_at": "2026-11-27T04:06:02.144939Z", "started_at": null, "finished_at": null, "error": null, "result": null, "venue_revision": null, "asked_by": null, "options": {"priority": "routine", "timeout_s": null, "preset": "esc", "search": "auto", "seed": 1662126948, "generations": 100, "parents": 64, "offspring": 128, "stitch_weight": 0.5, "flat": false, "fit_focal_length": false, "fit_ridge": false, "dry_run": true, "pictures": false}, "frames": {"left": ["/jobs/01M8DJX04439TYSYCC0VWFT25G/frames/0"], "right": ["/jobs/01M8DJX04439TYSYCC0VWFT25G/frames/1"]}, "links": {"self": "/jobs/01M8DJX04439TYSYCC0VWFT25G", "events": "/jobs/01M8DJX04439TYSYCC0VWFT25G/events", "cancel": "/jobs/01M8DJX04439TYSYCC0VWFT25G/cancel", "venue": "/venues/partly"}}', '01M8DJX04439TYSYCC0VWFT25G', 'anyone', '127.0.0.1', '39aadd8890704732ae1276fd7e1706d8');
INSERT INTO public.events VALUES (17, 'partly', 'job.succeeded', '2026-11-27 04:06:02.805586+00', NULL, '01M8DJX04439TYSYCC0VWFT25G', NULL, NULL, NULL);
INSERT INTO public.events VALUES (18, 'fail', 'venue.created', '2026-11-27 04:06:03.060754+00', '{"venue": "fail", "changed": []}', NULL, 'anyone', '127.0.0.1', '7a18f1ec5776465386a05c5c5e8b71c0');
INSERT INTO public.events VALUES (19, 'fail', 'poses.changed', '2026-11-27 04:06:03.062344+00', '{"venue": "fail", "revision": 1, "cause": "put", "job": null, "stitch_error_px": null, "ridge": null, "cameras": [{"id": "left", "image_size": [64, 48], "intrinsics": {"model": "opencv", "matrix": [[60.0, 0.0, 32.0], [0.0, 60.0, 24.0], [0.0, 0.0, 1.0]], "distortion": [], "sigma": null, "sigma_from": null}, "pose": {"rotation": [1.6, 0.1, -0.2], "position": [-1.0, -50.0, 8.0], "translation": [10.895927751576597, 5.882718243455158, 49.10878113434035]}}, {"id": "right", "image_size": [64, 48], "intrinsics": {"model": "opencv", "matrix": [[60.0, 0.0, 32.0], [0.0, 60.0, 24.0], [0.0, 0.0, 1.0]], "distortion": [], "sigma": null, "sigma_from": null}, "pose": {"rotation": [1.6, 0.1, -0.2], "position": [-1.0, -50.0, 8.0], "translation": [10.895927751576597, 5.882718243455158, 49.10878113434035]}}], "changed": ["left", "right"]}', NULL, 'anyone', '127.0.0.1', '7a18f1ec5776465386a05c5c5e8b71c0');
INSERT INTO public.events VALUES (20, 'fail', 'job.queued', '2026-11-27 04:06:03.108003+00', '{"id": "01M8DJX12NZQB83XX9NA7SW1SB", "kind": "calibration", "venue": "fail", "status": "queued", "progress": null, "queue_position": 1, "attempt": 0, "created_at": "2026-11-27T04:06:03.108003Z", "started_at": null, "finished_at": null, "error": null, "result": null, "venue_revision": null, "asked_by": null, "options": {"priority": "routine", "timeout_s": null, "preset": "esc", "search": "auto", "seed": 1285888602, "generations": 100, "parents": 64, "offspring": 128, "stitch_weight": 0.5, "flat": false, "fit_focal_length": false, "fit_ridge": false, "dry_run": false, "pictures": false}, "frames": {"left": ["/jobs/01M8DJX12NZQB83XX9NA7SW1SB/frames/0"], "right": ["/jobs/01M8DJX12NZQB83XX9NA7SW1SB/frames/1"]}, "links": {"self": "/jobs/01M8DJX12NZQB83XX9NA7SW1SB", "events": "/jobs/01M8DJX12NZQB83XX9NA7SW1SB/events", "cancel": "/jobs/01M8DJX12NZQB83XX9NA7SW1SB/cancel", "venue": "/venues/fail"}}', '01M8DJX12NZQB83XX9NA7SW1SB', 'anyone', '127.0.0.1', '6e44a82af3d04177a74f238176271faf');
INSERT INTO public.events VALUES (21, 'fail', 'job.failed', '2026-11-27 04:06:03.28178+00', NULL, '01M8DJX12NZQB83XX9NA7SW1SB', NULL, NULL, NULL);
INSERT INTO public.events VALUES (22, 'knock', 'venue.created', '2026-11-27 04:06:03.322035+00', '{"venue": "knock", "changed": []}', NULL, 'anyone', '127.0.0.1', 'a1bfd8437f524fd18c0ad46e5f83d68d');
INSERT INTO public.events VALUES (23, 'knock', 'poses.changed', '2026-11-27 04:06:03.323847+00', '{"venue": "knock", "revision": 1, "cause": "put", "job": null, "stitch_error_px": null, "ridge": null, "cameras": [{"id": "left", "image_size": [64, 48], "intrinsics": {"model": "opencv", "matrix": [[60.0, 0.0, 32.0], [0.0, 60.0, 24.0], [0.0, 0.0, 1.0]], "distortion": [], "sigma": null, "sigma_from": null}, "pose": {"rotation": [1.6, 0.1, -0.2], "position": [-1.0, -50.0, 8.0], "translation": [10.895927751576597, 5.882718243455158, 49.10878113434035]}}, {"id": "right", "image_size": [64, 48], "intrinsics": {"model": "opencv", "matrix": [[60.0, 0.0, 32.0], [0.0, 60.0, 24.0], [0.0, 0.0, 1.0]], "distortion": [], "sigma": null, "sigma_from": null}, "pose": {"rotation": [1.6, 0.1, -0.2], "position": [-1.0, -50.0, 8.0], "translation": [10.895927751576597, 5.882718243455158, 49.10878113434035]}}], "changed": ["left", "right"]}', NULL, 'anyone', '127.0.0.1', 'a1bfd8437f524fd18c0ad46e5f83d68d');
INSERT INTO public.events VALUES (24, 'knock', 'job.queued', '2026-11-27 04:06:03.384954+00', '{"id": "01M8DJX1B9TPHVCW82SFCG4BC6", "kind": "calibration", "venue": "knock", "status": "queued", "progress": null, "queue_position": 1, "attempt": 0, "created_at": "2026-11-27T04:06:03.384954Z", "started_at": null, "finished_at": null, "error": null, "result": null, "venue_revision": null, "asked_by": null, "options": {"priority": "routine", "timeout_s": null, "preset": "esc", "search": "auto", "seed": 1501752989, "generations": 100, "parents": 64, "offspring": 128, "stitch_weight": 0.5, "flat": false, "fit_focal_length": false, "fit_ridge": false, "dry_run": false, "pictures": false}, "frames": {"left": ["/jobs/01M8DJX1B9TPHVCW82SFCG4BC6/frames/0"], "right": ["/jobs/01M8DJX1B9TPHVCW82SFCG4BC6/frames/1"]}, "links": {"self": "/jobs/01M8DJX1B9TPHVCW82SFCG4BC6", "events": "/jobs/01M8DJX1B9TPHVCW82SFCG4BC6/events", "cancel": "/jobs/01M8DJX1B9TPHVCW82SFCG4BC6/cancel", "venue": "/venues/knock"}}', '01M8DJX1B9TPHVCW82SFCG4BC6', 'anyone', '127.0.0.1', '75795ab0c6ba4771a4ee54493f551c14');
INSERT INTO public.events VALUES (27, 'contradict', 'venue.created', '2026-11-27 04:06:04.128688+00', '{"venue": "contradict", "changed": []}', NULL, 'anyone', '127.0.0.1', '6f7107c6e35b4dc193c77acf9b7a273d');
INSERT INTO public.events VALUES (25, 'knock', 'poses.changed', '2026-11-27 04:06:04.002956+00', '{"venue": "knock", "revision": 2, "cause": "calibrated", "job": "01M8DJX1B9TPHVCW82SFCG4BC6", "stitch_error_px": 0.2, "ridge": null, "cameras": [{"id": "left", "image_size": [64, 48], "intrinsics": {"model": "opencv", "matrix": [[60.0, 0.0, 32.0], [0.0, 60.0, 24.0], [0.0, 0.0, 1.0]], "distortion": [], "sigma": null, "sigma_from": null}, "pose": {"rotation": [1.6, 0.1, -0.2], "position": [-0.875, -43.75, 7.0], "translation": [9.533936782629521, 5.147378463023262, 42.97018349254782]}}, {"id": "right", "image_size": [64, 48], "intrinsics": {"model": "opencv", "matrix": [[60.0, 0.0, 32.0], [0.0, 60.0, 24.0], [0.0, 0.0, 1.0]], "distortion": [], "sigma": null, "sigma_from": null}, "pose": {"rotation": [1.6, 0.1, -0.2], "position": [-1.0, -50.0, 8.0], "translation": [10.895927751576597, 5.882718243455158, 49.10878113434035]}}], "changed": ["left"]}', NULL, 'anyone', '127.0.0.1', '75795ab0c6ba4771a4ee54493f551c14');
INSERT INTO public.events VALUES (26, 'knock', 'job.succeeded', '2026-11-27 04:06:04.002956+00', NULL, '01M8DJX1B9TPHVCW82SFCG4BC6', NULL, NULL, NULL);
INSERT INTO public.events VALUES (33, 'reject', 'job.succeeded', '2026-11-27 04:06:05.950546+00', NULL, '01M8DJX3AF6NNCVEJTCVWA0VQ8', NULL, NULL, NULL);
INSERT INTO public.events VALUES (35, 'reject', 'job.failed', '2026-11-27 04:06:06.55711+00', NULL, '01M8DJX42JP4DTW4VYZ5FZ2SE8', NULL, NULL, NULL);
INSERT INTO public.events VALUES (28, 'contradict', 'poses.changed', '2026-11-27 04:06:04.140076+00', '{"venue": "contradict", "revision": 1, "cause": "put", "job": null, "stitch_error_px": null, "ridge": null, "cameras": [{"id": "left", "image_size": [64, 48], "intrinsics": {"model": "opencv", "matrix": [[60.0, 0.0, 32.0], [0.0, 60.0, 24.0], [0.0, 0.0, 1.0]], "distortion": [], "sigma": null, "sigma_from": null}, "pose": {"rotation": [1.6, 0.1, -0.2], "position": [-1.0, -50.0, 8.0], "translation": [10.895927751576597, 5.882718243455158, 49.10878113434035]}}, {"id": "right", "image_size": [64, 48], "intrinsics": {"model": "opencv", "matrix": [[60.0, 0.0, 32.0], [0.0, 60.0, 24.0], [0.0, 0.0, 1.0]], "distortion": [], "sigma": null, "sigma_from": null}, "pose": {"rotation": [1.6, 0.1, -0.2], "position": [-1.0, -50.0, 8.0], "translation": [10.895927751576597, 5.882718243455158, 49.10878113434035]}}], "changed": ["left", "right"]}', NULL, 'anyone', '127.0.0.1', '6f7107c6e35b4dc193c77acf9b7a273d');
INSERT INTO public.events VALUES (29, 'contradict', 'job.queued', '2026-11-27 04:06:04.27151+00', '{"id": "01M8DJX26QQMBWQ1Q4D8YDTW9D", "kind": "calibration", "venue": "contradict", "status": "queued", "progress": null, "queue_position": 1, "attempt": 0, "created_at": "2026-11-27T04:06:04.271510Z", "started_at": null, "finished_at": null, "error": null, "result": null, "venue_revision": null, "asked_by": null, "options": {"priority": "routine", "timeout_s": null, "preset": "esc", "search": "auto", "seed": 1810711779, "generations": 100, "parents": 64, "offspring": 128, "stitch_weight": 0.5, "flat": false, "fit_focal_length": false, "fit_ridge": false, "dry_run": false, "pictures": false}, "frames": {"left": ["/jobs/01M8DJX26QQMBWQ1Q4D8YDTW9D/frames/0"], "right": ["/jobs/01M8DJX26QQMBWQ1Q4D8YDTW9D/frames/1"]}, "links": {"self": "/jobs/01M8DJX26QQMBWQ1Q4D8YDTW9D", "events": "/jobs/01M8DJX26QQMBWQ1Q4D8YDTW9D/events", "cancel": "/jobs/01M8DJX26QQMBWQ1Q4D8YDTW9D/cancel", "venue": "/venues/contradict"}}', '01M8DJX26QQMBWQ1Q4D8YDTW9D', 'anyone', '127.0.0.1', '922fb976601e45349de59db64609b8e5');
INSERT INTO public.events VALUES (34, 'reject', 'job.queued', '2026-11-27 04:06:06.16674+00', '{"id": "01M8DJX42JP4DTW4VYZ5FZ2SE8", "kind": "locate", "venue": "reject", "status": "queued", "progress": null, "queue_position": 1, "attempt": 0, "created_at": "2026-11-27T04:06:06.166740Z", "started_at": null, "finished_at": null, "error": null, "result": null, "venue_revision": null, "asked_by": null, "options": {"priority": "routine", "timeout_s": null, "points": [{"world": [0.0, 0.0], "pixel": [5.0, 5.0]}, {"world": [0.0, 1.0], "pixel": [5.0, 15.0]}, {"world": [1.0, 0.0], "pixel": [15.0, 5.0]}, {"world": [1.0, 1.0], "pixel": [15.0, 15.0]}]}, "frames": {"left": []}, "links": {"self": "/jobs/01M8DJX42JP4DTW4VYZ5FZ2SE8", "events": "/jobs/01M8DJX42JP4DTW4VYZ5FZ2SE8/events", "cancel": "/jobs/01M8DJX42JP4DTW4VYZ5FZ2SE8/cancel", "venue": "/venues/reject"}}', '01M8DJX42JP4DTW4VYZ5FZ2SE8', 'anyone', '127.0.0.1', '400079843ddb4f4f8424f18228b4d35b');
INSERT INTO public.events VALUES (36, 'reject', 'job.queued', '2026-11-27 04:06:06.681413+00', '{"id": "01M8DJX4J3KKF00YMKQPEM4WJZ", "kind": "find", "venue": "reject", "status": "queued", "progress": null, "queue_position": 1, "attempt": 0, "created_at": "2026-11-27T04:06:06.681413Z", "started_at": null, "finished_at": null, "error": null, "result": null, "venue_revision": null, "asked_by": null, "options": {"priority": "routine", "timeout_s": null, "cameras": null, "find_lens": false, "position_radius_m": null, "seed": 547253201}, "frames": {"left": ["/jobs/01M8DJX4J3KKF00YMKQPEM4WJZ/frames/0"], "right": ["/jobs/01M8DJX4J3KKF00YMKQPEM4WJZ/frames/1"]}, "links": {"self": "/jobs/01M8DJX4J3KKF00YMKQPEM4WJZ", "events": "/jobs/01M8DJX4J3KKF00YMKQPEM4WJZ/events", "cancel": "/jobs/01M8DJX4J3KKF00YMKQPEM4WJZ/cancel", "venue": "/venues/reject"}}', '01M8DJX4J3KKF00YMKQPEM4WJZ', 'anyone', '127.0.0.1', '28e93e3e6c164458946fe518ffadb85a');
INSERT INTO public.events VALUES (30, 'contradict', 'poses.changed', '2026-11-27 04:06:05.015394+00', '{"venue": "contradict", "revision": 2, "cause": "calibrated", "job": "01M8DJX26QQMBWQ1Q4D8YDTW9D", "stitch_error_px": 0.2, "ridge": null, "cameras": [{"id": "left", "image_size": [64, 48], "intrinsics": {"model": "opencv", "matrix": [[60.0, 0.0, 32.0], [0.0, 60.0, 24.0], [0.0, 0.0, 1.0]], "distortion": [], "sigma": null, "sigma_from": null}, "pose": {"rotation": [1.6, 0.1, -0.2], "position": [-0.875, -43.75, 7.0], "translation": [9.533936782629521, 5.147378463023262, 42.97018349254782]}}, {"id": "right", "image_size": [64, 48], "intrinsics": {"model": "opencv", "matrix": [[60.0, 0.0, 32.0], [0.0, 60.0, 24.0], [0.0, 0.0, 1.0]], "distortion": [], "sigma": null, "sigma_from": null}, "pose": {"rotation": [1.6, 0.1, -0.2], "position": [-0.875, -43.75, 7.0], "translation": [9.533936782629521, 5.147378463023262, 42.97018349254782]}}], "changed": ["left", "right"]}', NULL, 'anyone', '127.0.0.1', '922fb976601e45349de59db64609b8e5');
INSERT INTO public.events VALUES (31, 'contradict', 'job.succeeded', '2026-11-27 04:06:05.015394+00', NULL, '01M8DJX26QQMBWQ1Q4D8YDTW9D', NULL, NULL, NULL);
INSERT INTO public.events VALUES (37, 'reject', 'job.succeeded', '2026-11-27 04:06:07.010573+00', NULL, '01M8DJX4J3KKF00YMKQPEM4WJZ', NULL, NULL, NULL);
INSERT INTO public.events VALUES (32, 'reject', 'job.queued', '2026-11-27 04:06:05.423013+00', '{"id": "01M8DJX3AF6NNCVEJTCVWA0VQ8", "kind": "field", "venue": "reject", "status": "queued", "progress": null, "queue_position": 1, "attempt": 0, "created_at": "2026-11-27T04:06:05.423013Z", "started_at": null, "finished_at": null, "error": null, "result": null, "venue_revision": null, "asked_by": null, "options": {"priority": "routine", "timeout_s": null, "seed": 813699401}, "frames": {"left": ["/jobs/01M8DJX3AF6NNCVEJTCVWA0VQ8/frames/0"], "right": ["/jobs/01M8DJX3AF6NNCVEJTCVWA0VQ8/frames/1"]}, "links": {"self": "/jobs/01M8DJX3AF6NNCVEJTCVWA0VQ8", "events": "/jobs/01M8DJX3AF6NNCVEJTCVWA0VQ8/events", "cancel": "/jobs/01M8DJX3AF6NNCVEJTCVWA0VQ8/cancel", "venue": "/venues/reject"}}', '01M8DJX3AF6NNCVEJTCVWA0VQ8', 'anyone', '127.0.0.1', 'fcdc1be792d740f5957655968925a284');
INSERT INTO public.events VALUES (38, 'waiting', 'venue.created', '2026-11-27 04:06:29.263594+00', '{"venue": "waiting", "changed": []}', NULL, 'anyone', '127.0.0.1', '7795bd8c61ac4f7895c840de29093444');
INSERT INTO public.events VALUES (39, 'waiting', 'poses.changed', '2026-11-27 04:06:29.279811+00', '{"venue": "waiting", "revision": 1, "cause": "put", "job": null, "stitch_error_px": null, "ridge": null, "cameras": [{"id": "left", "image_size": [64, 48], "intrinsics": {"model": "opencv", "matrix": [[60.0, 0.0, 32.0], [0.0, 60.0, 24.0], [0.0, 0.0, 1.0]], "distortion": [], "sigma": null, "sigma_from": null}, "pose": {"rotation": [1.6, 0.1, -0.2], "position": [-1.0, -50.0, 8.0], "translation": [10.895927751576597, 5.882718243455158, 49.10878113434035]}}, {"id": "right", "image_size": [64, 48], "intrinsics": {"model": "opencv", "matrix": [[60.0, 0.0, 32.0], [0.0, 60.0, 24.0], [0.0, 0.0, 1.0]], "distortion": [], "sigma": null, "sigma_from": null}, "pose": {"rotation": [1.6, 0.1, -0.2], "position": [-1.0, -50.0, 8.0], "translation": [10.895927751576597, 5.882718243455158, 49.10878113434035]}}], "changed": ["left", "right"]}', NULL, 'anyone', '127.0.0.1', '7795bd8c61ac4f7895c840de29093444');
INSERT INTO public.events VALUES (40, 'waiting', 'job.queued', '2026-11-27 04:06:29.739722+00', '{"id": "01M8DJXV153Z1EDZ0N1GN8Q5JW", "kind": "calibration", "venue": "waiting", "status": "queued", "progress": null, "queue_position": 1, "attempt": 0, "created_at": "2026-11-27T04:06:29.739722Z", "started_at": null, "finished_at": null, "error": null, "result": null, "venue_revision": null, "asked_by": null, "options": {"priority": "routine", "timeout_s": null, "preset": "esc", "search": "auto", "seed": 682513664, "generations": 100, "parents": 64, "offspring": 128, "stitch_weight": 0.5, "flat": false, "fit_focal_length": false, "fit_ridge": false, "dry_run": false, "pictures": false}, "frames": {"left": ["/jobs/01M8DJXV153Z1EDZ0N1GN8Q5JW/frames/0"], "right": ["/jobs/01M8DJXV153Z1EDZ0N1GN8Q5JW/frames/1"]}, "links": {"self": "/jobs/01M8DJXV153Z1EDZ0N1GN8Q5JW", "events": "/jobs/01M8DJXV153Z1EDZ0N1GN8Q5JW/events", "cancel": "/jobs/01M8DJXV153Z1EDZ0N1GN8Q5JW/cancel", "venue": "/venues/waiting"}}', '01M8DJXV153Z1EDZ0N1GN8Q5JW', 'anyone', '127.0.0.1', 'b693c08fe0b84c4d8df759dd1e3539da');
INSERT INTO public.events VALUES (41, 'cancelled', 'venue.created', '2026-11-27 04:06:29.945668+00', '{"venue": "cancelled", "changed": []}', NULL, 'anyone', '127.0.0.1', '7e5fd1cfc52a4db0b8180581701d7350');
INSERT INTO public.events VALUES (42, 'cancelled', 'poses.changed', '2026-11-27 04:06:29.955837+00', '{"venue": "cancelled", "revision": 1, "cause": "put", "job": null, "stitch_error_px": null, "ridge": null, "cameras": [{"id": "left", "image_size": [64, 48], "intrinsics": {"model": "opencv", "matrix": [[60.0, 0.0, 32.0], [0.0, 60.0, 24.0], [0.0, 0.0, 1.0]], "distortion": [], "sigma": null, "sigma_from": null}, "pose": {"rotation": [1.6, 0.1, -0.2], "position": [-1.0, -50.0, 8.0], "translation": [10.895927751576597, 5.882718243455158, 49.10878113434035]}}, {"id": "right", "image_size": [64, 48], "intrinsics": {"model": "opencv", "matrix": [[60.0, 0.0, 32.0], [0.0, 60.0, 24.0], [0.0, 0.0, 1.0]], "distortion": [], "sigma": null, "sigma_from": null}, "pose": {"rotation": [1.6, 0.1, -0.2], "position": [-1.0, -50.0, 8.0], "translation": [10.895927751576597, 5.882718243455158, 49.10878113434035]}}], "changed": ["left", "right"]}', NULL, 'anyone', '127.0.0.1', '7e5fd1cfc52a4db0b8180581701d7350');
INSERT INTO public.events VALUES (43, 'cancelled', 'job.queued', '2026-11-27 04:06:30.097455+00', '{"id": "01M8DJXVCR0N7EED0CMV0FJMG9", "kind": "calibration", "venue": "cancelled", "status": "queued", "progress": null, "queue_position": 2, "attempt": 0, "created_at": "2026-11-27T04:06:30.097455Z", "started_at": null, "finished_at": null, "error": null, "result": null, "venue_revision": null, "asked_by": null, "options": {"priority": "routine", "timeout_s": null, "preset": "esc", "search": "auto", "seed": 1500714924, "generations": 100, "parents": 64, "offspring": 128, "stitch_weight": 0.5, "flat": false, "fit_focal_length": false, "fit_ridge": false, "dry_run": false, "pictures": false}, "frames": {"left": ["/jobs/01M8DJXVCR0N7EED0CMV0FJMG9/frames/0"], "right": ["/jobs/01M8DJXVCR0N7EED0CMV0FJMG9/frames/1"]}, "links": {"self": "/jobs/01M8DJXVCR0N7EED0CMV0FJMG9", "events": "/jobs/01M8DJXVCR0N7EED0CMV0FJMG9/events", "cancel": "/jobs/01M8DJXVCR0N7EED0CMV0FJMG9/cancel", "venue": "/venues/cancelled"}}', '01M8DJXVCR0N7EED0CMV0FJMG9', 'anyone', '127.0.0.1', '8e9ca63fc6874e80a1d3cae6a1b589fd');
INSERT INTO public.events VALUES (44, 'cancelled', 'job.cancelled', '2026-11-27 04:06:30.146563+00', NULL, '01M8DJXVCR0N7EED0CMV0FJMG9', 'anyone', '127.0.0.1', '3dbdf5f362e7492fb326ba14f8f85fd9');
INSERT INTO public.jobs VALUES ('01M8DJWW30GY62AEMFQTSVX516', 'calibration', 'everything', 'succeeded', 100, '{"priority": "routine", "timeout_s": null, "callback_url": "https://example.com/end", "preset": "esc", "search": "auto", "seed": 1641036203, "generations": 100, "parents": 64, "offspring": 128, "stitch_weight": 0.5, "flat": false, "fit_focal_length": false, "fit_ridge": false, "dry_run": false, "pictures": false}', 'eafed287b216c15889fc967c7a1cbe23049be978c695b93e2c10844ef38ad42a', 'first', '{"id": "everything", "name": "refine", "field": {"length_m": 105.0, "width_m": 68.0, "line_width_m": 0.12, "ridge": [[-18.5, 0.0, 0.2], [18.5, 0.0, 0.2]]}, "cameras": [{"id": "left", "image_size": [64, 48], "intrinsics": {"matrix": [[60.0, 0.0, 32.0], [0.0, 60.0, 24.0], [0.0, 0.0, 1.0]], "distortion": []}, "pose": {"rotation": [1.6, 0.1, -0.2], "position": [-1.0, -50.0, 8.0], "translation": [10.895927751576597, 5.882718243455158, 49.10878113434035]}, "ignore": [[[0.0, 40.0], [20.0, 40.0], [20.0, 47.0]]], "source": "http://***@example.com/a.jpg"}, {"id": "right", "image_size": [64, 48], "intrinsics": {"matrix": [[60.0, 0.0, 32.0], [0.0, 60.0, 24.0], [0.0, 0.0, 1.0]], "distortion": [], "sigma": {"fx": 0.5}}, "pose": {"rotation": [1.6, 0.1, -0.2], "position": [-1.0, -50.0, 8.0], "translation": [10.895927751576597, 5.882718243455158, 49.10878113434035]}, "source": "http://example.com/b.jpg"}], "accept": "all", "lens": "may-drift", "alarms": {"moved_since_first_px": 40.0, "rejected_in_a_row": 1, "callback_url": "https://example.com/alarms"}, "schedule": {"cron": "0 3 1 1 *", "time_zone": "Europe/Berlin", "options": {"seed": 3}}, "webhooks": [{"url": "https://example.com/told", "events": ["poses.changed", "venue.*"]}]}', '{"left": ["frames/01M8DJWW30GY62AEMFQTSVX516/left/0.05ae4ed8657e98a06fb22560a86d3dd2dcfb85962a96ee82d6000a88471de30b"], "right": ["frames/01M8DJWW30GY62AEMFQTSVX516/right/0.05ae4ed8657e98a06fb22560a86d3dd2dcfb85962a96ee82d6000a88471de30b"]}', 1, 'e9158ca8ccd34b1999cc5384e5f7b6d3', 4, '{"stage": "preview", "fraction": 1.0, "generation": null, "loss": null}', '{"verdict": "accepted", "accepted": true, "rejected_because": null, "cameras": [{"id": "left", "accepted": true, "rejected_because": null, "pose": {"rotation": [1.6, 0.1, -0.2], "position": [-0.875, -43.75, 7.0], "translation": [9.533936782629521, 5.147378463023262, 42.97018349254782]}, "sigma": null, "moved": {"rotation_deg": 0.0, "position_m": 6.4, "pixels": 1.0}, "iou": 0.9, "residual_px": 1.0}, {"id": "right", "accepted": true, "rejected_because": null, "pose": {"rotation": [1.6, 0.1, -0.2], "position": [-0.875, -43.75, 7.0], "translation": [9.533936782629521, 5.147378463023262, 42.97018349254782]}, "sigma": null, "moved": {"rotation_deg": 0.0, "position_m": 6.4, "pixels": 1.0}, "iou": 0.9, "residual_px": 1.0}], "stitch_error_px": 0.2, "stitch_error_before_px": 10.0, "loss": 0.1, "generations": 10, "timings_s": {"decode": 0.1}, "provenance": {"software": "0", "model_sha256": "0", "seed": 1641036203, "options": {"priority": "routine", "timeout_s": null, "callback_url": null, "preset": "esc", "search": "auto", "seed": 1641036203, "generations": 100, "parents": 64, "offspring": 128, "stitch_weight": 0.5, "flat": false, "fit_focal_length": false, "fit_ridge": false, "dry_run": false, "pictures": false}}}', '["preview", "birdseye", "overlay_left", "overlay_right"]', NULL, '2026-11-27 04:05:58.032664+00', '2026-11-27 04:05:58.477097+00', '2026-11-27 04:05:59.706832+00', '2026-11-27 04:05:59.706832+00', NULL, NULL, NULL, '6777b76bc8d340eb941cbd6cc03a64dc', NULL, '{"own": {"view": {"projection": "cylinder", "width_px": 1280}, "recover": "accept"}, "of_parts": {"alarms": {"trend_m": 0.2, "knocked": true}, "schedule": {"frames": 2, "spacing_s": 7.0}, "field": {"uneven_m": 0.004, "sigma": {"width_m": 0.2}}}, "of_cameras": {"left": {"light": {"gain": [1.06, 1.0, 0.94], "contrast": 0.1}}}}', '{"of_cameras": {"left": {"refined": {"pose": {"rotation": [1.6, 0.1, -0.2], "position": [-0.875, -43.75, 7.02], "translation": [9.53526186332061, 5.1673262465606875, 42.97075802984524]}, "intrinsics": {"matrix": [[60.059999999999995, 0.0, 32.0], [0.0, 60.059999999999995, 24.0], [0.0, 0.0, 1.0]], "distortion": [0.0, 0.0, 0.0, 0.0], "sigma": {"fx": 0.01}}, "covariance": null, "sigma": null, "longer": 0.001, "differs_m": 0.034}, "lens_change": {"longer": 0.006, "sigma": 0.001, "since": "2026-11-03T02:00:00Z", "words": "focal length 0.6 \u00b1 0.1 % longer than on 3 November: zoom ring or focus"}, "nights": 1, "displacement": {"anchor": null, "at": [-20.0, 34.0], "across_m": 0.03, "away_m": 0.04, "sigma_across_m": 0.01, "sigma_away_m": 0.02, "repeatability_across_m": 0.005, "repeatability_away_m": 0.01, "rotation_deg": 0.01, "position_m": 0.001, "focal_length": 0.0001, "sigma_focal_length": 0.0002, "focal_length_m": 60.0}}, "right": {"refined": {"pose": {"rotation": [1.6, 0.1, -0.2], "position": [-0.875, -43.75, 7.02], "translation": [9.53526186332061, 5.1673262465606875, 42.97075802984524]}, "intrinsics": {"matrix": [[60.059999999999995, 0.0, 32.0], [0.0, 60.059999999999995, 24.0], [0.0, 0.0, 1.0]], "distortion": [0.0, 0.0, 0.0, 0.0], "sigma": {"fx": 0.01}}, "covariance": null, "sigma": null, "longer": 0.001, "differs_m": 0.034}, "lens_change": {"longer": 0.006, "sigma": 0.001, "since": "2026-11-03T02:00:00Z", "words": "focal length 0.6 \u00b1 0.1 % longer than on 3 November: zoom ring or focus"}, "nights": 1, "displacement": {"anchor": null, "at": [-20.0, 34.0], "across_m": 0.03, "away_m": 0.04, "sigma_across_m": 0.01, "sigma_away_m": 0.02, "repeatability_across_m": 0.005, "repeatability_away_m": 0.01, "rotation_deg": 0.01, "position_m": 0.001, "focal_length": 0.0001, "sigma_focal_length": 0.0002, "focal_length_m": 60.0}}}}', '127.0.0.1', NULL);
INSERT INTO public.jobs VALUES ('01M8DJWYA057W0MVSJPJ78RF4T', 'calibration', 'everything', 'succeeded', 100, '{"priority": "routine", "timeout_s": null, "callback_url": null, "preset": "esc", "search": "auto", "seed": 1824516984, "generations": 100, "parents": 64, "offspring": 128, "stitch_weight": 0.5, "flat": true, "fit_focal_length": false, "fit_ridge": false, "dry_run": false, "pictures": false}', 'dfdcb0ca6abb47178127ebe2f08441dd7fc4a3c46b6f568e66a3e497c0cea502', NULL, '{"id": "everything", "name": "refine", "field": {"length_m": 105.0, "width_m": 68.0, "line_width_m": 0.12, "ridge": [[-18.5, 0.0, 0.2], [18.5, 0.0, 0.2]]}, "cameras": [{"id": "left", "image_size": [64, 48], "intrinsics": {"matrix": [[60.0, 0.0, 32.0], [0.0, 60.0, 24.0], [0.0, 0.0, 1.0]], "distortion": []}, "pose": {"rotation": [1.6, 0.1, -0.2], "position": [-0.875, -43.75, 7.0], "translation": [9.533936782629521, 5.147378463023262, 42.97018349254782]}, "ignore": [[[0.0, 40.0], [20.0, 40.0], [20.0, 47.0]]], "source": "http://***@example.com/a.jpg"}, {"id": "right", "image_size": [64, 48], "intrinsics": {"matrix": [[60.0, 0.0, 32.0], [0.0, 60.0, 24.0], [0.0, 0.0, 1.0]], "distortion": [], "sigma": {"fx": 0.5}}, "pose": {"rotation": [1.6, 0.1, -0.2], "position": [-0.875, -43.75, 7.0], "translation": [9.533936782629521, 5.147378463023262, 42.97018349254782]}, "source": "http://example.com/b.jpg"}], "accept": "all", "lens": "may-drift", "alarms": {"moved_since_first_px": 40.0, "rejected_in_a_row": 1, "callback_url": "https://example.com/alarms"}, "schedule": {"cron": "0 3 1 1 *", "time_zone": "Europe/Berlin", "options": {"seed": 3}}, "webhooks": [{"url": "https://example.com/told", "events": ["poses.changed", "venue.*"]}]}', '{"left": ["frames/01M8DJWYA057W0MVSJPJ78RF4T/left/0.2f407a1a6e5c503511125d7eabf67ce5ca23457a774fd06f62ed600753a43e4b"], "right": ["frames/01M8DJWYA057W0MVSJPJ78RF4T/right/0.2f407a1a6e5c503511125d7eabf67ce5ca23457a774fd06f62ed600753a43e4b"]}', 1, '8a0f069e4d9e40a5ab10fa7154b119c8', 4, '{"stage": "preview", "fraction": 1.0, "generation": null, "loss": null}', '{"verdict": "accepted", "accepted": true, "rejected_because": null, "cameras": [{"id": "left", "accepted": true, "rejected_because": null, "pose": {"rotation": [1.6, 0.1, -0.2], "position": [-0.765625, -38.28125, 6.125], "translation": [8.34219468480083, 4.503956155145355, 37.59891055597933]}, "sigma": null, "moved": {"rotation_deg": 0.0, "position_m": 6.4, "pixels": 1.0}, "iou": 0.9, "residual_px": 1.0}, {"id": "right", "accepted": true, "rejected_because": null, "pose": {"rotation": [1.6, 0.1, -0.2], "position": [-0.765625, -38.28125, 6.125], "translation": [8.34219468480083, 4.503956155145355, 37.59891055597933]}, "sigma": null, "moved": {"rotation_deg": 0.0, "position_m": 6.4, "pixels": 1.0}, "iou": 0.9, "residual_px": 1.0}], "stitch_error_px": 0.2, "stitch_error_before_px": 10.0, "loss": 0.1, "generations": 10, "timings_s": {"decode": 0.1}, "provenance": {"software": "0", "model_sha256": "0", "seed": 1824516984, "options": {"priority": "routine", "timeout_s": null, "callback_url": null, "preset": "esc", "search": "auto", "seed": 1824516984, "generations": 100, "parents": 64, "offspring": 128, "stitch_weight": 0.5, "flat": true, "fit_focal_length": false, "fit_ridge": false, "dry_run": false, "pictures": false}}}', '["preview", "birdseye", "overlay_left", "overlay_right"]', NULL, '2026-11-27 04:06:00.282891+00', '2026-11-27 04:06:00.58564+00', '2026-11-27 04:06:00.826721+00', '2026-11-27 04:06:00.826721+00', NULL, NULL, NULL, '6c2ea00515314d6c88b7594f82607dac', NULL, '{"own": {"view": {"projection": "cylinder", "width_px": 1280}, "recover": "accept"}, "of_parts": {"alarms": {"trend_m": 0.2, "knocked": true}, "schedule": {"frames": 2, "spacing_s": 7.0}, "field": {"uneven_m": 0.004, "sigma": {"width_m": 0.2}}}, "of_cameras": {"left": {"light": {"gain": [1.06, 1.0, 0.94], "contrast": 0.1}}}}', '{"of_cameras": {"left": {"refined": {"pose": {"rotation": [1.6, 0.1, -0.2], "position": [-0.765625, -38.28125, 6.145], "translation": [8.34351976549192, 4.523903938682779, 37.599485093276755]}, "intrinsics": {"matrix": [[60.059999999999995, 0.0, 32.0], [0.0, 60.059999999999995, 24.0], [0.0, 0.0, 1.0]], "distortion": [0.0, 0.0, 0.0, 0.0], "sigma": {"fx": 0.01}}, "covariance": null, "sigma": null, "longer": 0.001, "differs_m": 0.034}, "lens_change": {"longer": 0.006, "sigma": 0.001, "since": "2026-11-03T02:00:00Z", "words": "focal length 0.6 \u00b1 0.1 % longer than on 3 November: zoom ring or focus"}, "nights": 2, "displacement": {"anchor": 1, "at": [-20.0, 34.0], "across_m": 0.03, "away_m": 0.04, "sigma_across_m": 0.01, "sigma_away_m": 0.02, "repeatability_across_m": 0.005, "repeatability_away_m": 0.01, "rotation_deg": 0.01, "position_m": 0.001, "focal_length": 0.0001, "sigma_focal_length": 0.0002, "focal_length_m": 60.0}}, "right": {"refined": {"pose": {"rotation": [1.6, 0.1, -0.2], "position": [-0.765625, -38.28125, 6.145], "translation": [8.34351976549192, 4.523903938682779, 37.599485093276755]}, "intrinsics": {"matrix": [[60.059999999999995, 0.0, 32.0], [0.0, 60.059999999999995, 24.0], [0.0, 0.0, 1.0]], "distortion": [0.0, 0.0, 0.0, 0.0], "sigma": {"fx": 0.01}}, "covariance": null, "sigma": null, "longer": 0.001, "differs_m": 0.034}, "lens_change": {"longer": 0.006, "sigma": 0.001, "since": "2026-11-03T02:00:00Z", "words": "focal length 0.6 \u00b1 0.1 % longer than on 3 November: zoom ring or focus"}, "nights": 2, "displacement": {"anchor": 1, "at": [-20.0, 34.0], "across_m": 0.03, "away_m": 0.04, "sigma_across_m": 0.01, "sigma_away_m": 0.02, "repeatability_across_m": 0.005, "repeatability_away_m": 0.01, "rotation_deg": 0.01, "position_m": 0.001, "focal_length": 0.0001, "sigma_focal_length": 0.0002, "focal_length_m": 60.0}}}}', '127.0.0.1', NULL);
INSERT INTO public.jobs VALUES ('01M8DJX42JP4DTW4VYZ5FZ2SE8', 'locate', 'reject', 'failed', 100, '{"priority": "routine", "timeout_s": null, "callback_url": null, "points": [{"world": [0.0, 0.0], "pixel": [5.0, 5.0]}, {"world": [0.0, 1.0], "pixel": [5.0, 15.0]}, {"world": [1.0, 0.0], "pixel": [15.0, 5.0]}, {"world": [1.0, 1.0], "pixel": [15.0, 15.0]}]}', '37d329fd1d09cf2464de1c1cce636e901ba74c23700bf257d6268bbbe60cad1f', NULL, '{"id": "reject", "name": "reject", "field": {"length_m": 105.0, "width_m": 68.0, "line_width_m": 0.12}, "cameras": [{"id": "left", "image_size": [64, 48], "intrinsics": {"matrix": [[60.0, 0.0, 32.0], [0.0, 60.0, 24.0], [0.0, 0.0, 1.0]], "distortion": []}, "pose": {"rotation": [1.6, 0.1, -0.2], "position": [-1.0, -50.0, 8.0], "translation": [10.895927751576597, 5.882718243455158, 49.10878113434035]}}, {"id": "right", "image_size": [64, 48], "intrinsics": {"matrix": [[60.0, 0.0, 32.0], [0.0, 60.0, 24.0], [0.0, 0.0, 1.0]], "distortion": []}, "pose": {"rotation": [1.6, 0.1, -0.2], "position": [-1.0, -50.0, 8.0], "translation": [10.895927751576597, 5.882718243455158, 49.10878113434035]}}]}', '{"left": []}', 1, 'de0bf062cb7945d48e186a403286e730', 4, '{"stage": "segmentation", "fraction": 0.1, "generation": null, "loss": null}', NULL, NULL, '{"type": "/problems/no-pose", "title": "", "detail": "This program only moves cameras."}', '2026-11-27 04:06:06.16674+00', '2026-11-27 04:06:06.331172+00', '2026-11-27 04:06:06.55711+00', '2026-11-27 04:06:06.55711+00', NULL, NULL, NULL, '400079843ddb4f4f8424f18228b4d35b', NULL, NULL, NULL, '127.0.0.1', NULL);
INSERT INTO public.jobs VALUES ('01M8DJWZAQKH0A39ZWEFVQHFMP', 'calibration', 'reject', 'succeeded', 100, '{"priority": "routine", "timeout_s": null, "callback_url": null, "preset": "esc", "search": "auto", "seed": 1047423431, "generations": 100, "parents": 64, "offspring": 128, "stitch_weight": 0.5, "flat": false, "fit_focal_length": false, "fit_ridge": false, "dry_run": false, "pictures": false}', '166038974189b3168e8b65814acd6a80f17651bf65e8b2a4a5218378ef574326', NULL, '{"id": "reject", "name": "reject", "field": {"length_m": 105.0, "width_m": 68.0, "line_width_m": 0.12}, "cameras": [{"id": "left", "image_size": [64, 48], "intrinsics": {"matrix": [[60.0, 0.0, 32.0], [0.0, 60.0, 24.0], [0.0, 0.0, 1.0]], "distortion": []}, "pose": {"rotation": [1.6, 0.1, -0.2], "position": [-1.0, -50.0, 8.0], "translation": [10.895927751576597, 5.882718243455158, 49.10878113434035]}}, {"id": "right", "image_size": [64, 48], "intrinsics": {"matrix": [[60.0, 0.0, 32.0], [0.0, 60.0, 24.0], [0.0, 0.0, 1.0]], "distortion": []}, "pose": {"rotation": [1.6, 0.1, -0.2], "position": [-1.0, -50.0, 8.0], "translation": [10.895927751576597, 5.882718243455158, 49.10878113434035]}}]}', '{"left": ["frames/01M8DJWZAQKH0A39ZWEFVQHFMP/left/0.05ae4ed8657e98a06fb22560a86d3dd2dcfb85962a96ee82d6000a88471de30b"], "right": ["frames/01M8DJWZAQKH0A39ZWEFVQHFMP/right/0.05ae4ed8657e98a06fb22560a86d3dd2dcfb85962a96ee82d6000a88471de30b"]}', 1, 'bf6f0f9b738b42bf9a5ef1221d004757', 4, '{"stage": "preview", "fraction": 1.0, "generation": null, "loss": null}', '{"verdict": "rejected", "accepted": false, "rejected_because": "the lines do not fit", "cameras": [{"id": "left", "accepted": false, "rejected_because": "the lines do not fit", "pose": {"rotation": [1.6, 0.1, -0.2], "position": [-0.875, -43.75, 7.0], "translation": [9.533936782629521, 5.147378463023262, 42.97018349254782]}, "sigma": null, "moved": {"rotation_deg": 0.0, "position_m": 6.4, "pixels": 1.0}, "iou": 0.9, "residual_px": 1.0}, {"id": "right", "accepted": false, "rejected_because": "the lines do not fit", "pose": {"rotation": [1.6, 0.1, -0.2], "position": [-0.875, -43.75, 7.0], "translation": [9.533936782629521, 5.147378463023262, 42.97018349254782]}, "sigma": null, "moved": {"rotation_deg": 0.0, "position_m": 6.4, "pixels": 1.0}, "iou": 0.9, "residual_px": 1.0}], "stitch_error_px": 0.2, "stitch_error_before_px": 10.0, "loss": 0.1, "generations": 10, "timings_s": {"decode": 0.1}, "provenance": {"software": "0", "model_sha256": "0", "seed": 1047423431, "options": {"priority": "routine", "timeout_s": null, "callback_url": null, "preset": "esc", "search": "auto", "seed": 1047423431, "generations": 100, "parents": 64, "offspring": 128, "stitch_weight": 0.5, "flat": false, "fit_focal_length": false, "fit_ridge": false, "dry_run": false, "pictures": false}}}', '["birdseye", "overlay_left", "overlay_right"]', NULL, '2026-11-27 04:06:01.327809+00', '2026-11-27 04:06:01.615248+00', '2026-11-27 04:06:01.851813+00', '2026-11-27 04:06:01.851813+00', NULL, NULL, NULL, 'b2dc499feec94d1da533714779c798ad', NULL, NULL, '{"of_cameras": {"left": {"displacement": {"anchor": null, "at": [-20.0, 34.0], "across_m": 0.03, "away_m": 0.04, "sigma_across_m": 0.01, "sigma_away_m": 0.02, "repeatability_across_m": 0.005, "repeatability_away_m": 0.01, "rotation_deg": 0.01, "position_m": 0.001, "focal_length": 0.0001, "sigma_focal_length": 0.0002, "focal_length_m": 60.0}}, "right": {"displacement": {"anchor": null, "at": [-20.0, 34.0], "across_m": 0.03, "away_m": 0.04, "sigma_across_m": 0.01, "sigma_away_m": 0.02, "repeatability_across_m": 0.005, "repeatability_away_m": 0.01, "rotation_deg": 0.01, "position_m": 0.001, "focal_length": 0.0001, "sigma_focal_length": 0.0002, "focal_length_m": 60.0}}}}', '127.0.0.1', NULL);
INSERT INTO public.jobs VALUES ('01M8DJX04439TYSYCC0VWFT25G', 'calibration', 'partly', 'succeeded', 100, '{"priority": "routine", "timeout_s": null, "callback_url": null, "preset": "esc", "search": "auto", "seed": 1662126948, "generations": 100, "parents": 64, "offspring": 128, "stitch_weight": 0.5, "flat": false, "fit_focal_length": false, "fit_ridge": false, "dry_run": true, "pictures": false}', '72931535960c38863760dc0e9ff187aa99d3d4304bc2a5ba4ea5fa11848e27e9', NULL, '{"id": "partly", "name": "partly", "field": {"length_m": 105.0, "width_m": 68.0, "line_width_m": 0.12}, "cameras": [{"id": "left", "image_size": [64, 48], "intrinsics": {"matrix": [[60.0, 0.0, 32.0], [0.0, 60.0, 24.0], [0.0, 0.0, 1.0]], "distortion": []}, "pose": {"rotation": [1.6, 0.1, -0.2], "position": [-1.0, -50.0, 8.0], "translation": [10.895927751576597, 5.882718243455158, 49.10878113434035]}}, {"id": "right", "image_size": [64, 48], "intrinsics": {"matrix": [[60.0, 0.0, 32.0], [0.0, 60.0, 24.0], [0.0, 0.0, 1.0]], "distortion": []}, "pose": {"rotation": [1.6, 0.1, -0.2], "position": [-1.0, -50.0, 8.0], "translation": [10.895927751576597, 5.882718243455158, 49.10878113434035]}}]}', '{"left": ["frames/01M8DJX04439TYSYCC0VWFT25G/left/0.05ae4ed8657e98a06fb22560a86d3dd2dcfb85962a96ee82d6000a88471de30b"], "right": ["frames/01M8DJX04439TYSYCC0VWFT25G/right/0.05ae4ed8657e98a06fb22560a86d3dd2dcfb85962a96ee82d6000a88471de30b"]}', 1, '90b9413211144930b4d9af1ec037f943', 4, '{"stage": "preview", "fraction": 1.0, "generation": null, "loss": null}', '{"verdict": "partly", "accepted": false, "rejected_because": "the lines do not fit", "cameras": [{"id": "left", "accepted": true, "rejected_because": null, "pose": {"rotation": [1.6, 0.1, -0.2], "position": [-0.875, -43.75, 7.0], "translation": [9.533936782629521, 5.147378463023262, 42.97018349254782]}, "sigma": null, "moved": {"rotation_deg": 0.0, "position_m": 6.4, "pixels": 1.0}, "iou": 0.9, "residual_px": 1.0}, {"id": "right", "accepted": false, "rejected_because": "the lines do not fit", "pose": {"rotation": [1.6, 0.1, -0.2], "position": [-0.875, -43.75, 7.0], "translation": [9.533936782629521, 5.147378463023262, 42.97018349254782]}, "sigma": null, "moved": {"rotation_deg": 0.0, "position_m": 6.4, "pixels": 1.0}, "iou": 0.9, "residual_px": 1.0}], "stitch_error_px": 0.2, "stitch_error_before_px": 10.0, "loss": 0.1, "generations": 10, "timings_s": {"decode": 0.1}, "provenance": {"software": "0", "model_sha256": "0", "seed": 1662126948, "options": {"priority": "routine", "timeout_s": null, "callback_url": null, "preset": "esc", "search": "auto", "seed": 1662126948, "generations": 100, "parents": 64, "offspring": 128, "stitch_weight": 0.5, "flat": false, "fit_focal_length": false, "fit_ridge": false, "dry_run": true, "pictures": false}}}', '["preview", "birdseye", "overlay_left", "overlay_right"]', NULL, '2026-11-27 04:06:02.144939+00', '2026-11-27 04:06:02.62803+00', '2026-11-27 04:06:02.805586+00', '2026-11-27 04:06:02.805586+00', NULL, NULL, NULL, '39aadd8890704732ae1276fd7e1706d8', NULL, NULL, '{"of_cameras": {"left": {"displacement": {"anchor": null, "at": [-20.0, 34.0], "across_m": 0.03, "away_m": 0.04, "sigma_across_m": 0.01, "sigma_away_m": 0.02, "repeatability_across_m": 0.005, "repeatability_away_m": 0.01, "rotation_deg": 0.01, "position_m": 0.001, "focal_length": 0.0001, "sigma_focal_length": 0.0002, "focal_length_m": 60.0}}, "right": {"displacement": {"anchor": null, "at": [-20.0, 34.0], "across_m": 0.03, "away_m": 0.04, "sigma_across_m": 0.01, "sigma_away_m": 0.02, "repeatability_across_m": 0.005, "repeatability_away_m": 0.01, "rotation_deg": 0.01, "position_m": 0.001, "focal_length": 0.0001, "sigma_focal_length": 0.0002, "focal_length_m": 60.0}}}}', '127.0.0.1', NULL);
INSERT INTO public.jobs VALUES ('01M8DJX12NZQB83XX9NA7SW1SB', 'calibration', 'fail', 'failed', 100, '{"priority": "routine", "timeout_s": null, "callback_url": null, "preset": "esc", "search": "auto", "seed": 1285888602, "generations": 100, "parents": 64, "offspring": 128, "stitch_weight": 0.5, "flat": false, "fit_focal_length": false, "fit_ridge": false, "dry_run": false, "pictures": false}', '166038974189b3168e8b65814acd6a80f17651bf65e8b2a4a5218378ef574326', NULL, '{"id": "fail", "name": "fail", "field": {"length_m": 105.0, "width_m": 68.0, "line_width_m": 0.12}, "cameras": [{"id": "left", "image_size": [64, 48], "intrinsics": {"matrix": [[60.0, 0.0, 32.0], [0.0, 60.0, 24.0], [0.0, 0.0, 1.0]], "distortion": []}, "pose": {"rotation": [1.6, 0.1, -0.2], "position": [-1.0, -50.0, 8.0], "translation": [10.895927751576597, 5.882718243455158, 49.10878113434035]}}, {"id": "right", "image_size": [64, 48], "intrinsics": {"matrix": [[60.0, 0.0, 32.0], [0.0, 60.0, 24.0], [0.0, 0.0, 1.0]], "distortion": []}, "pose": {"rotation": [1.6, 0.1, -0.2], "position": [-1.0, -50.0, 8.0], "translation": [10.895927751576597, 5.882718243455158, 49.10878113434035]}}]}', '{"left": ["frames/01M8DJX12NZQB83XX9NA7SW1SB/left/0.05ae4ed8657e98a06fb22560a86d3dd2dcfb85962a96ee82d6000a88471de30b"], "right": ["frames/01M8DJX12NZQB83XX9NA7SW1SB/right/0.05ae4ed8657e98a06fb22560a86d3dd2dcfb85962a96ee82d6000a88471de30b"]}', 1, 'e3202bd1ad97469b9e6ec352ae5b4a4c', 4, '{"stage": "segmentation", "fraction": 0.1, "generation": null, "loss": null}', NULL, NULL, '{"type": "/problems/no-markings-in-view", "title": "", "detail": "It is black.", "camera": "left"}', '2026-11-27 04:06:03.108003+00', '2026-11-27 04:06:03.150537+00', '2026-11-27 04:06:03.28178+00', '2026-11-27 04:06:03.28178+00', NULL, NULL, NULL, '6e44a82af3d04177a74f238176271faf', NULL, NULL, NULL, '127.0.0.1', NULL);
INSERT INTO public.jobs VALUES ('01M8DJX1B9TPHVCW82SFCG4BC6', 'calibration', 'knock', 'succeeded', 100, '{"priority": "routine", "timeout_s": null, "callback_url": null, "preset": "esc", "search": "auto", "seed": 1501752989, "generations": 100, "parents": 64, "offspring": 128, "stitch_weight": 0.5, "flat": false, "fit_focal_length": false, "fit_ridge": false, "dry_run": false, "pictures": false}', '166038974189b3168e8b65814acd6a80f17651bf65e8b2a4a5218378ef574326', NULL, '{"id": "knock", "name": "knock", "field": {"length_m": 105.0, "width_m": 68.0, "line_width_m": 0.12}, "cameras": [{"id": "left", "image_size": [64, 48], "intrinsics": {"matrix": [[60.0, 0.0, 32.0], [0.0, 60.0, 24.0], [0.0, 0.0, 1.0]], "distortion": []}, "pose": {"rotation": [1.6, 0.1, -0.2], "position": [-1.0, -50.0, 8.0], "translation": [10.895927751576597, 5.882718243455158, 49.10878113434035]}}, {"id": "right", "image_size": [64, 48], "intrinsics": {"matrix": [[60.0, 0.0, 32.0], [0.0, 60.0, 24.0], [0.0, 0.0, 1.0]], "distortion": []}, "pose": {"rotation": [1.6, 0.1, -0.2], "position": [-1.0, -50.0, 8.0], "translation": [10.895927751576597, 5.882718243455158, 49.10878113434035]}}]}', '{"left": ["frames/01M8DJX1B9TPHVCW82SFCG4BC6/left/0.05ae4ed8657e98a06fb22560a86d3dd2dcfb85962a96ee82d6000a88471de30b"], "right": ["frames/01M8DJX1B9TPHVCW82SFCG4BC6/right/0.05ae4ed8657e98a06fb22560a86d3dd2dcfb85962a96ee82d6000a88471de30b"]}', 1, '314fb5253cc04e47bf0ddbf4f52a606c', 4, '{"stage": "preview", "fraction": 1.0, "generation": null, "loss": null}', '{"verdict": "partly", "accepted": false, "rejected_because": "the lines do not fit", "cameras": [{"id": "left", "accepted": true, "rejected_because": null, "pose": {"rotation": [1.6, 0.1, -0.2], "position": [-0.875, -43.75, 7.0], "translation": [9.533936782629521, 5.147378463023262, 42.97018349254782]}, "sigma": null, "moved": {"rotation_deg": 0.0, "position_m": 6.4, "pixels": 1.0}, "iou": 0.9, "residual_px": 1.0}, {"id": "right", "accepted": false, "rejected_because": "turned by 11.2 degrees and moved by 0.30 m, and found again", "refusal": "/refusals/knocked", "pose": {"rotation": [1.6, 0.1, -0.2], "position": [-0.875, -43.75, 7.0], "translation": [9.533936782629521, 5.147378463023262, 42.97018349254782]}, "sigma": null, "moved": {"rotation_deg": 11.2, "position_m": 0.3, "pixels": 400.0}, "iou": 0.9, "residual_px": 1.0}], "stitch_error_px": 0.2, "stitch_error_before_px": 10.0, "loss": 0.1, "generations": 10, "timings_s": {"decode": 0.1}, "provenance": {"software": "0", "model_sha256": "0", "seed": 1501752989, "options": {"priority": "routine", "timeout_s": null, "callback_url": null, "preset": "esc", "search": "auto", "seed": 1501752989, "generations": 100, "parents": 64, "offspring": 128, "stitch_weight": 0.5, "flat": false, "fit_focal_length": false, "fit_ridge": false, "dry_run": false, "pictures": false}}}', '["preview", "birdseye", "overlay_left", "overlay_right"]', NULL, '2026-11-27 04:06:03.384954+00', '2026-11-27 04:06:03.691224+00', '2026-11-27 04:06:04.002956+00', '2026-11-27 04:06:04.002956+00', NULL, NULL, NULL, '75795ab0c6ba4771a4ee54493f551c14', NULL, NULL, '{"of_cameras": {"left": {"displacement": {"anchor": null, "at": [-20.0, 34.0], "across_m": 0.03, "away_m": 0.04, "sigma_across_m": 0.01, "sigma_away_m": 0.02, "repeatability_across_m": 0.005, "repeatability_away_m": 0.01, "rotation_deg": 0.01, "position_m": 0.001, "focal_length": 0.0001, "sigma_focal_length": 0.0002, "focal_length_m": 60.0}}, "right": {"displacement": {"anchor": null, "at": [-20.0, 34.0], "across_m": 0.03, "away_m": 0.04, "sigma_across_m": 0.01, "sigma_away_m": 0.02, "repeatability_across_m": 0.005, "repeatability_away_m": 0.01, "rotation_deg": 0.01, "position_m": 0.001, "focal_length": 0.0001, "sigma_focal_length": 0.0002, "focal_length_m": 60.0}, "knocked": true, "proposed": {"pose": {"rotation": [1.6, 0.1, -0.2], "position": [-0.875, -43.75, 7.0], "translation": [9.533936782629521, 5.147378463023262, 42.97018349254782]}, "sigma": null, "moved": {"rotation_deg": 11.2, "position_m": 0.3, "pixels": 400.0}, "found": 0.97}}}}', '127.0.0.1', NULL);
INSERT INTO public.jobs VALUES ('01M8DJX4J3KKF00YMKQPEM4WJZ', 'find', 'reject', 'succeeded', 100, '{"priority": "routine", "timeout_s": null, "callback_url": null, "cameras": null, "find_lens": false, "position_radius_m": null, "seed": 547253201}', '9dca05c4a74c00705643dfc6bcef4cad9d9a9c76a7c984fa2657d63ce5ee0e2f', NULL, '{"id": "reject", "name": "reject", "field": {"length_m": 105.0, "width_m": 68.0, "line_width_m": 0.12}, "cameras": [{"id": "left", "image_size": [64, 48], "intrinsics": {"matrix": [[60.0, 0.0, 32.0], [0.0, 60.0, 24.0], [0.0, 0.0, 1.0]], "distortion": []}, "pose": {"rotation": [1.6, 0.1, -0.2], "position": [-1.0, -50.0, 8.0], "translation": [10.895927751576597, 5.882718243455158, 49.10878113434035]}}, {"id": "right", "image_size": [64, 48], "intrinsics": {"matrix": [[60.0, 0.0, 32.0], [0.0, 60.0, 24.0], [0.0, 0.0, 1.0]], "distortion": []}, "pose": {"rotation": [1.6, 0.1, -0.2], "position": [-1.0, -50.0, 8.0], "translation": [10.895927751576597, 5.882718243455158, 49.10878113434035]}}]}', '{"left": ["frames/01M8DJX4J3KKF00YMKQPEM4WJZ/left/0.05ae4ed8657e98a06fb22560a86d3dd2dcfb85962a96ee82d6000a88471de30b"], "right": ["frames/01M8DJX4J3KKF00YMKQPEM4WJZ/right/0.05ae4ed8657e98a06fb22560a86d3dd2dcfb85962a96ee82d6000a88471de30b"]}', 1, '57426ad62c444f22af11e472db104265', 4, '{"stage": "preview", "fraction": 1.0, "generation": null, "loss": null}', '{"accepted": false, "rejected_because": "camera left: two poses explain the frame alike; camera right: two poses explain the frame alike", "cameras": [{"id": "left", "accepted": false, "reason": "not-unique", "rejected_because": "two poses explain the frame alike", "remarks": ["assumed: it stands on the near side"], "image_size": [64, 48], "candidates": [{"intrinsics": {"matrix": [[50.0, 0.0, 32.0], [0.0, 50.0, 24.0], [0.0, 0.0, 1.0]], "distortion": [], "sigma": {"fx": 0.5}}, "pose": {"rotation": [1.5707963267948966, 0.0, 0.0], "position": [0.0, -40.0, 8.0], "translation": [0.0, 8.0, 40.0]}, "agreement": 0.8, "lines_found": 0.9, "residual_px": 1.0, "sigma": {"rotation_deg": 0.35, "position_m": 0.17}}, {"intrinsics": {"matrix": [[50.0, 0.0, 32.0], [0.0, 50.0, 24.0], [0.0, 0.0, 1.0]], "distortion": [], "sigma": {"fx": 0.5}}, "pose": {"rotation": [1.5707963267948966, 0.0, 0.0], "position": [0.0, -60.0, 8.0], "translation": [0.0, 8.0, 60.0]}, "agreement": 0.8, "lines_found": 0.9, "residual_px": 1.0, "sigma": {"rotation_deg": 0.35, "position_m": 0.17}}]}, {"id": "right", "accepted": false, "reason": "not-unique", "rejected_because": "two poses explain the frame alike", "remarks": ["assumed: it stands on the near side"], "image_size": [64, 48], "candidates": [{"intrinsics": {"matrix": [[50.0, 0.0, 32.0], [0.0, 50.0, 24.0], [0.0, 0.0, 1.0]], "distortion": [], "sigma": {"fx": 0.5}}, "pose": {"rotation": [1.5707963267948966, 0.0, 0.0], "position": [0.0, -40.0, 8.0], "translation": [0.0, 8.0, 40.0]}, "agreement": 0.8, "lines_found": 0.9, "residual_px": 1.0, "sigma": {"rotation_deg": 0.35, "position_m": 0.17}}, {"intrinsics": {"matrix": [[50.0, 0.0, 32.0], [0.0, 50.0, 24.0], [0.0, 0.0, 1.0]], "distortion": [], "sigma": {"fx": 0.5}}, "pose": {"rotation": [1.5707963267948966, 0.0, 0.0], "position": [0.0, -60.0, 8.0], "translation": [0.0, 8.0, 60.0]}, "agreement": 0.8, "lines_found": 0.9, "residual_px": 1.0, "sigma": {"rotation_deg": 0.35, "position_m": 0.17}}]}], "stitch_error_px": 0.4, "timings_s": {"evolution": 0.1}, "provenance": {"software": "0", "model_sha256": "0", "seed": 547253201, "options": {}}}', '["candidate_left_1", "candidate_left_2", "candidate_right_1", "candidate_right_2"]', NULL, '2026-11-27 04:06:06.681413+00', '2026-11-27 04:06:06.838157+00', '2026-11-27 04:06:07.010573+00', '2026-11-27 04:06:07.010573+00', NULL, NULL, NULL, '28e93e3e6c164458946fe518ffadb85a', NULL, NULL, NULL, '127.0.0.1', NULL);
INSERT INTO public.jobs VALUES ('01M8DJX26QQMBWQ1Q4D8YDTW9D', 'calibration', 'contradict', 'succeeded', 100, '{"priority": "routine", "timeout_s": null, "callback_url": null, "preset": "esc", "search": "auto", "seed": 1810711779, "generations": 100, "parents": 64, "offspring": 128, "stitch_weight": 0.5, "flat": false, "fit_focal_length": false, "fit_ridge": false, "dry_run": false, "pictures": false}', '166038974189b3168e8b65814acd6a80f17651bf65e8b2a4a5218378ef574326', NULL, '{"id": "contradict", "name": "contradict", "field": {"length_m": 105.0, "width_m": 68.0, "line_width_m": 0.12}, "cameras": [{"id": "left", "image_size": [64, 48], "intrinsics": {"matrix": [[60.0, 0.0, 32.0], [0.0, 60.0, 24.0], [0.0, 0.0, 1.0]], "distortion": []}, "pose": {"rotation": [1.6, 0.1, -0.2], "position": [-1.0, -50.0, 8.0], "translation": [10.895927751576597, 5.882718243455158, 49.10878113434035]}}, {"id": "right", "image_size": [64, 48], "intrinsics": {"matrix": [[60.0, 0.0, 32.0], [0.0, 60.0, 24.0], [0.0, 0.0, 1.0]], "distortion": []}, "pose": {"rotation": [1.6, 0.1, -0.2], "position": [-1.0, -50.0, 8.0], "translation": [10.895927751576597, 5.882718243455158, 49.10878113434035]}}]}', '{"left": ["frames/01M8DJX26QQMBWQ1Q4D8YDTW9D/left/0.05ae4ed8657e98a06fb22560a86d3dd2dcfb85962a96ee82d6000a88471de30b"], "right": ["frames/01M8DJX26QQMBWQ1Q4D8YDTW9D/right/0.05ae4ed8657e98a06fb22560a86d3dd2dcfb85962a96ee82d6000a88471de30b"]}', 1, '0f14fa7ae85d4fd7865e07f227c9e463', 4, '{"stage": "preview", "fraction": 1.0, "generation": null, "loss": null}', '{"verdict": "accepted", "accepted": true, "rejected_because": null, "cameras": [{"id": "left", "accepted": true, "rejected_because": null, "pose": {"rotation": [1.6, 0.1, -0.2], "position": [-0.875, -43.75, 7.0], "translation": [9.533936782629521, 5.147378463023262, 42.97018349254782]}, "sigma": null, "moved": {"rotation_deg": 0.0, "position_m": 6.4, "pixels": 1.0}, "iou": 0.9, "residual_px": 1.0}, {"id": "right", "accepted": true, "rejected_because": null, "pose": {"rotation": [1.6, 0.1, -0.2], "position": [-0.875, -43.75, 7.0], "translation": [9.533936782629521, 5.147378463023262, 42.97018349254782]}, "sigma": null, "moved": {"rotation_deg": 0.0, "position_m": 6.4, "pixels": 1.0}, "iou": 0.9, "residual_px": 1.0}], "diagnosis": [{"camera": null, "quantity": "ridge_height_m", "deviation": 0.332, "sigma": 0.051, "detail": "the lines fit a ridge"}, {"camera": null, "quantity": "length_m", "deviation": 26.5, "sigma": 0.2, "detail": "the lines fit a length"}], "stitch_error_px": 0.2, "stitch_error_before_px": 10.0, "loss": 0.1, "generations": 10, "timings_s": {"decode": 0.1}, "provenance": {"software": "0", "model_sha256": "0", "seed": 1810711779, "options": {"priority": "routine", "timeout_s": null, "callback_url": null, "preset": "esc", "search": "auto", "seed": 1810711779, "generations": 100, "parents": 64, "offspring": 128, "stitch_weight": 0.5, "flat": false, "fit_focal_length": false, "fit_ridge": false, "dry_run": false, "pictures": false}}}', '["preview", "birdseye", "overlay_left", "overlay_right"]', NULL, '2026-11-27 04:06:04.27151+00', '2026-11-27 04:06:04.728437+00', '2026-11-27 04:06:05.015394+00', '2026-11-27 04:06:05.015394+00', NULL, NULL, NULL, '922fb976601e45349de59db64609b8e5', NULL, NULL, '{"own": {"adoptable": [{"name": "ridge_height_m", "given": 0.0, "value": 0.332, "sigma": 0.051, "moves_m": {"left": 0.081, "right": 0.079}}, {"name": "length_m", "given": 105.0, "value": 131.5, "sigma": 0.2, "moves_m": {"left": 0.081, "right": 0.079}}]}, "of_cameras": {"left": {"displacement": {"anchor": null, "at": [-20.0, 34.0], "across_m": 0.03, "away_m": 0.04, "sigma_across_m": 0.01, "sigma_away_m": 0.02, "repeatability_across_m": 0.005, "repeatability_away_m": 0.01, "rotation_deg": 0.01, "position_m": 0.001, "focal_length": 0.0001, "sigma_focal_length": 0.0002, "focal_length_m": 60.0}}, "right": {"displacement": {"anchor": null, "at": [-20.0, 34.0], "across_m": 0.03, "away_m": 0.04, "sigma_across_m": 0.01, "sigma_away_m": 0.02, "repeatability_across_m": 0.005, "repeatability_away_m": 0.01, "rotation_deg": 0.01, "position_m": 0.001, "focal_length": 0.0001, "sigma_focal_length": 0.0002, "focal_length_m": 60.0}}}}', '127.0.0.1', NULL);
INSERT INTO public.jobs VALUES ('01M8DJXV153Z1EDZ0N1GN8Q5JW', 'calibration', 'waiting', 'queued', 100, '{"priority": "routine", "timeout_s": null, "callback_url": null, "preset": "esc", "search": "auto", "seed": 682513664, "generations": 100, "parents": 64, "offspring": 128, "stitch_weight": 0.5, "flat": false, "fit_focal_length": false, "fit_ridge": false, "dry_run": false, "pictures": false}', '166038974189b3168e8b65814acd6a80f17651bf65e8b2a4a5218378ef574326', 'waits', '{"id": "waiting", "name": "accept", "field": {"length_m": 105.0, "width_m": 68.0, "line_width_m": 0.12}, "cameras": [{"id": "left", "image_size": [64, 48], "intrinsics": {"matrix": [[60.0, 0.0, 32.0], [0.0, 60.0, 24.0], [0.0, 0.0, 1.0]], "distortion": []}, "pose": {"rotation": [1.6, 0.1, -0.2], "position": [-1.0, -50.0, 8.0], "translation": [10.895927751576597, 5.882718243455158, 49.10878113434035]}}, {"id": "right", "image_size": [64, 48], "intrinsics": {"matrix": [[60.0, 0.0, 32.0], [0.0, 60.0, 24.0], [0.0, 0.0, 1.0]], "distortion": []}, "pose": {"rotation": [1.6, 0.1, -0.2], "position": [-1.0, -50.0, 8.0], "translation": [10.895927751576597, 5.882718243455158, 49.10878113434035]}}]}', '{"left": ["frames/01M8DJXV153Z1EDZ0N1GN8Q5JW/left/0.05ae4ed8657e98a06fb22560a86d3dd2dcfb85962a96ee82d6000a88471de30b"], "right": ["frames/01M8DJXV153Z1EDZ0N1GN8Q5JW/right/0.05ae4ed8657e98a06fb22560a86d3dd2dcfb85962a96ee82d6000a88471de30b"]}', 0, NULL, 1, NULL, NULL, NULL, NULL, '2026-11-27 04:06:29.739722+00', NULL, NULL, '2026-11-27 04:06:29.739722+00', NULL, NULL, NULL, 'b693c08fe0b84c4d8df759dd1e3539da', NULL, NULL, NULL, '127.0.0.1', NULL);
INSERT INTO public.jobs VALUES ('01M8DJX3AF6NNCVEJTCVWA0VQ8', 'field', 'reject', 'succeeded', 100, '{"priority": "routine", "timeout_s": null, "callback_url": null, "seed": 813699401}', '6f8bf866d481fd5c00a602017513785d63eee08a51e5096e6dd43c9cb1427ee2', NULL, '{"id": "reject", "name": "reject", "field": {"length_m": 105.0, "width_m": 68.0, "line_width_m": 0.12}, "cameras": [{"id": "left", "image_size": [64, 48], "intrinsics": {"matrix": [[60.0, 0.0, 32.0], [0.0, 60.0, 24.0], [0.0, 0.0, 1.0]], "distortion": []}, "pose": {"rotation": [1.6, 0.1, -0.2], "position": [-1.0, -50.0, 8.0], "translation": [10.895927751576597, 5.882718243455158, 49.10878113434035]}}, {"id": "right", "image_size": [64, 48], "intrinsics": {"matrix": [[60.0, 0.0, 32.0], [0.0, 60.0, 24.0], [0.0, 0.0, 1.0]], "distortion": []}, "pose": {"rotation": [1.6, 0.1, -0.2], "position": [-1.0, -50.0, 8.0], "translation": [10.895927751576597, 5.882718243455158, 49.10878113434035]}}]}', '{"left": ["frames/01M8DJX3AF6NNCVEJTCVWA0VQ8/left/0.05ae4ed8657e98a06fb22560a86d3dd2dcfb85962a96ee82d6000a88471de30b"], "right": ["frames/01M8DJX3AF6NNCVEJTCVWA0VQ8/right/0.05ae4ed8657e98a06fb22560a86d3dd2dcfb85962a96ee82d6000a88471de30b"]}', 1, '2cba03d54cb94a72a329ac4220ef64b9', 4, '{"stage": "preview", "fraction": 1.0, "generation": null, "loss": null}', '{"accepted": false, "rejected_because": "the lines do not fit", "field": {"length_m": 104.25, "width_m": 68.0, "line_width_m": 0.12}, "measures": [{"name": "length_m", "given": 105.0, "value": 104.25, "sigma": 0.05, "open": 5.0, "known": true, "detail": ""}, {"name": "width_m", "given": 68.0, "value": 67.0, "sigma": 5.0, "open": 5.0, "known": false, "detail": "no line seen"}], "cameras": [{"id": "left", "accepted": false, "rejected_because": "the lines do not fit", "pose": {"rotation": [1.6, 0.1, -0.2], "position": [-0.875, -43.75, 7.0], "translation": [9.533936782629521, 5.147378463023262, 42.97018349254782]}, "sigma": null, "moved": {"rotation_deg": 0.0, "position_m": 6.4, "pixels": 1.0}, "iou": 0.9, "residual_px": 1.0}, {"id": "right", "accepted": false, "rejected_because": "the lines do not fit", "pose": {"rotation": [1.6, 0.1, -0.2], "position": [-0.875, -43.75, 7.0], "translation": [9.533936782629521, 5.147378463023262, 42.97018349254782]}, "sigma": null, "moved": {"rotation_deg": 0.0, "position_m": 6.4, "pixels": 1.0}, "iou": 0.9, "residual_px": 1.0}], "stitch_error_px": 0.2, "timings_s": {"decode": 0.1}, "provenance": {"software": "0", "model_sha256": "0", "seed": 813699401, "options": {"priority": "routine", "timeout_s": null, "callback_url": null, "seed": 813699401}}}', '["overlay_right"]', NULL, '2026-11-27 04:06:05.423013+00', '2026-11-27 04:06:05.79389+00', '2026-11-27 04:06:05.950546+00', '2026-11-27 04:06:05.950546+00', NULL, NULL, NULL, 'fcdc1be792d740f5957655968925a284', NULL, NULL, '{"of_cameras": {"left": {"displacement": {"anchor": null, "at": [-20.0, 34.0], "across_m": 0.03, "away_m": 0.04, "sigma_across_m": 0.01, "sigma_away_m": 0.02, "repeatability_across_m": 0.005, "repeatability_away_m": 0.01, "rotation_deg": 0.01, "position_m": 0.001, "focal_length": 0.0001, "sigma_focal_length": 0.0002, "focal_length_m": 60.0}}, "right": {"displacement": {"anchor": null, "at": [-20.0, 34.0], "across_m": 0.03, "away_m": 0.04, "sigma_across_m": 0.01, "sigma_away_m": 0.02, "repeatability_across_m": 0.005, "repeatability_away_m": 0.01, "rotation_deg": 0.01, "position_m": 0.001, "focal_length": 0.0001, "sigma_focal_length": 0.0002, "focal_length_m": 60.0}}}}', '127.0.0.1', NULL);
INSERT INTO public.jobs VALUES ('01M8DJXVCR0N7EED0CMV0FJMG9', 'calibration', 'cancelled', 'cancelled', 100, '{"priority": "routine", "timeout_s": null, "callback_url": null, "preset": "esc", "search": "auto", "seed": 1500714924, "generations": 100, "parents": 64, "offspring": 128, "stitch_weight": 0.5, "flat": false, "fit_focal_length": false, "fit_ridge": false, "dry_run": false, "pictures": false}', '166038974189b3168e8b65814acd6a80f17651bf65e8b2a4a5218378ef574326', NULL, '{"id": "cancelled", "name": "accept", "field": {"length_m": 105.0, "width_m": 68.0, "line_width_m": 0.12}, "cameras": [{"id": "left", "image_size": [64, 48], "intrinsics": {"matrix": [[60.0, 0.0, 32.0], [0.0, 60.0, 24.0], [0.0, 0.0, 1.0]], "distortion": []}, "pose": {"rotation": [1.6, 0.1, -0.2], "position": [-1.0, -50.0, 8.0], "translation": [10.895927751576597, 5.882718243455158, 49.10878113434035]}}, {"id": "right", "image_size": [64, 48], "intrinsics": {"matrix": [[60.0, 0.0, 32.0], [0.0, 60.0, 24.0], [0.0, 0.0, 1.0]], "distortion": []}, "pose": {"rotation": [1.6, 0.1, -0.2], "position": [-1.0, -50.0, 8.0], "translation": [10.895927751576597, 5.882718243455158, 49.10878113434035]}}]}', '{"left": ["frames/01M8DJXVCR0N7EED0CMV0FJMG9/left/0.05ae4ed8657e98a06fb22560a86d3dd2dcfb85962a96ee82d6000a88471de30b"], "right": ["frames/01M8DJXVCR0N7EED0CMV0FJMG9/right/0.05ae4ed8657e98a06fb22560a86d3dd2dcfb85962a96ee82d6000a88471de30b"]}', 0, NULL, 2, NULL, NULL, NULL, NULL, '2026-11-27 04:06:30.097455+00', NULL, '2026-11-27 04:06:30.146563+00', '2026-11-27 04:06:30.146563+00', NULL, NULL, NULL, '8e9ca63fc6874e80a1d3cae6a1b589fd', NULL, NULL, NULL, '127.0.0.1', NULL);
INSERT INTO public.live_minutes VALUES ('everything', '2026-11-27 04:06:00+00', '{"left": {"pictures": 13, "measured": 12, "turned_deg": 0.02, "latency_ms": {"p50": 38.0, "p99": 61.5}}, "right": {}}');
INSERT INTO public.live_reports VALUES ('everything', '2026-11-27 04:06:01.186949+00', '{"started_at": "2026-11-23T10:00:00Z", "host": "truck-7", "pid": 4711, "destinations": ["opentrackio multicast"], "cameras": [{"id": "left", "status": "measured", "stream": "rtsp://***@10.1.0.7/main", "sigma": {"rotation_deg": 0.004, "position_m": 0.01}, "turned_deg": 0.02, "moved_m": 0.004, "taken_at": "2026-11-23T11:12:13.480000Z", "clock": "arrival", "pictures": 13, "left_out": 1, "measured": 12, "latency_ms": {"p50": 38.0, "p99": 61.5}, "pose": {"rotation": [1.6, 0.3, -0.4], "position": [-1.0, -49.0, 7.0], "translation": [22.297033127498864, 3.5004469107373537, 44.06346769304847]}}, {"id": "right", "status": "stored"}], "first_at": "2026-11-27T04:06:01.186949Z", "others": []}', '{"left": {}}', '2026-11-27 04:06:31.186949+00');
INSERT INTO public.memories VALUES ('everything', 2, '{"left": {"jobs": 1, "last": "2026-11-27T04:05:58.032664Z"}, "right": {"jobs": 1, "last": "2026-11-27T04:05:58.032664Z"}}');
INSERT INTO public.memories VALUES ('everything', 3, '{"left": {"jobs": 2, "last": "2026-11-27T04:06:00.282891Z"}, "right": {"jobs": 2, "last": "2026-11-27T04:06:00.282891Z"}}');
INSERT INTO public.memories VALUES ('everything', 4, '{}');
INSERT INTO public.revisions VALUES (1, 'everything', 1, '2026-11-27 04:05:57.709688+00', 'put', NULL, NULL, NULL, '[{"id": "left", "image_size": [64, 48], "intrinsics": {"matrix": [[60.0, 0.0, 32.0], [0.0, 60.0, 24.0], [0.0, 0.0, 1.0]], "distortion": []}, "pose": {"rotation": [1.6, 0.1, -0.2], "position": [-1.0, -50.0, 8.0], "translation": [10.895927751576597, 5.882718243455158, 49.10878113434035]}}, {"id": "right", "image_size": [64, 48], "intrinsics": {"matrix": [[60.0, 0.0, 32.0], [0.0, 60.0, 24.0], [0.0, 0.0, 1.0]], "distortion": [], "sigma": {"fx": 0.5}}, "pose": {"rotation": [1.6, 0.1, -0.2], "position": [-1.0, -50.0, 8.0], "translation": [10.895927751576597, 5.882718243455158, 49.10878113434035]}}]', '[[-18.5, 0.0, 0.2], [18.5, 0.0, 0.2]]', '{"left": {"moved": null, "drift": {"rotation_deg": 0.0, "position_m": 0.0, "pixels": 0.0}, "drift_since": 1}, "right": {"moved": null, "drift": {"rotation_deg": 0.0, "position_m": 0.0, "pixels": 0.0}, "drift_since": 1}}', 'anyone', '127.0.0.1', '4738f054e2194cb29ffd16adb9975a7e', NULL);
INSERT INTO public.revisions VALUES (2, 'everything', 2, '2026-11-27 04:05:59.706832+00', 'calibrated', '01M8DJWW30GY62AEMFQTSVX516', NULL, 0.2, '[{"id": "left", "image_size": [64, 48], "intrinsics": {"matrix": [[60.0, 0.0, 32.0], [0.0, 60.0, 24.0], [0.0, 0.0, 1.0]], "distortion": []}, "pose": {"rotation": [1.6, 0.1, -0.2], "position": [-0.875, -43.75, 7.0], "translation": [9.533936782629521, 5.147378463023262, 42.97018349254782]}}, {"id": "right", "image_size": [64, 48], "intrinsics": {"matrix": [[60.0, 0.0, 32.0], [0.0, 60.0, 24.0], [0.0, 0.0, 1.0]], "distortion": [], "sigma": {"fx": 0.5}}, "pose": {"rotation": [1.6, 0.1, -0.2], "position": [-0.875, -43.75, 7.0], "translation": [9.533936782629521, 5.147378463023262, 42.97018349254782]}}]', '[[-18.5, 0.0, 0.2], [18.5, 0.0, 0.2]]', '{"left": {"moved": {"rotation_deg": 0.0, "position_m": 6.3307286310503, "pixels": 1.9838683658745522}, "drift": {"rotation_deg": 0.0, "position_m": 6.3307286310503, "pixels": 1.9838683658745522}, "drift_since": 1}, "right": {"moved": {"rotation_deg": 0.0, "position_m": 6.3307286310503, "pixels": 1.9838683658745522}, "drift": {"rotation_deg": 0.0, "position_m": 6.3307286310503, "pixels": 1.9838683658745522}, "drift_since": 1}}', 'anyone', '127.0.0.1', '6777b76bc8d340eb941cbd6cc03a64dc', NULL);
INSERT INTO public.revisions VALUES (3, 'everything', 3, '2026-11-27 04:06:00.826721+00', 'calibrated', '01M8DJWYA057W0MVSJPJ78RF4T', NULL, 0.2, '[{"id": "left", "image_size": [64, 48], "intrinsics": {"matrix": [[60.0, 0.0, 32.0], [0.0, 60.0, 24.0], [0.0, 0.0, 1.0]], "distortion": []}, "pose": {"rotation": [1.6, 0.1, -0.2], "position": [-0.765625, -38.28125, 6.125], "translation": [8.34219468480083, 4.503956155145355, 37.59891055597933]}}, {"id": "right", "image_size": [64, 48], "intrinsics": {"matrix": [[60.0, 0.0, 32.0], [0.0, 60.0, 24.0], [0.0, 0.0, 1.0]], "distortion": [], "sigma": {"fx": 0.5}}, "pose": {"rotation": [1.6, 0.1, -0.2], "position": [-0.765625, -38.28125, 6.125], "translation": [8.34219468480083, 4.503956155145355, 37.59891055597933]}}]', '[[-18.5, 0.0, 0.2], [18.5, 0.0, 0.2]]', '{"left": {"moved": {"rotation_deg": 0.0, "position_m": 5.539387552169012, "pixels": 1.8055109552977968}, "drift": {"rotation_deg": 0.0, "position_m": 11.870116183219311, "pixels": 4.179859244701761}, "drift_since": 1}, "right": {"moved": {"rotation_deg": 0.0, "position_m": 5.539387552169012, "pixels": 1.8055109552977968}, "drift": {"rotation_deg": 0.0, "position_m": 11.870116183219311, "pixels": 4.179859244701761}, "drift_since": 1}}', 'anyone', '127.0.0.1', '6c2ea00515314d6c88b7594f82607dac', NULL);
INSERT INTO public.revisions VALUES (4, 'everything', 4, '2026-11-27 04:06:01.025438+00', 'restored', NULL, 1, NULL, '[{"id": "left", "image_size": [64, 48], "intrinsics": {"matrix": [[60.0, 0.0, 32.0], [0.0, 60.0, 24.0], [0.0, 0.0, 1.0]], "distortion": []}, "pose": {"rotation": [1.6, 0.1, -0.2], "position": [-1.0, -50.0, 8.0], "translation": [10.895927751576597, 5.882718243455158, 49.10878113434035]}}, {"id": "right", "image_size": [64, 48], "intrinsics": {"matrix": [[60.0, 0.0, 32.0], [0.0, 60.0, 24.0], [0.0, 0.0, 1.0]], "distortion": [], "sigma": {"fx": 0.5}}, "pose": {"rotation": [1.6, 0.1, -0.2], "position": [-1.0, -50.0, 8.0], "translation": [10.895927751576597, 5.882718243455158, 49.10878113434035]}}]', '[[-18.5, 0.0, 0.2], [18.5, 0.0, 0.2]]', '{"left": {"moved": {"rotation_deg": 0.0, "position_m": 11.870116183219311, "pixels": 2.899763883957856}, "drift": {"rotation_deg": 0.0, "position_m": 0.0, "pixels": 0.0}, "drift_since": 1}, "right": {"moved": {"rotation_deg": 0.0, "position_m": 11.870116183219311, "pixels": 2.899763883957856}, "drift": {"rotation_deg": 0.0, "position_m": 0.0, "pixels": 0.0}, "drift_since": 1}}', 'anyone', '127.0.0.1', '4b6cd88d51514bbabb38181c2c9cf386', NULL);
INSERT INTO public.revisions VALUES (5, 'reject', 1, '2026-11-27 04:06:01.244741+00', 'put', NULL, NULL, NULL, '[{"id": "left", "image_size": [64, 48], "intrinsics": {"matrix": [[60.0, 0.0, 32.0], [0.0, 60.0, 24.0], [0.0, 0.0, 1.0]], "distortion": []}, "pose": {"rotation": [1.6, 0.1, -0.2], "position": [-1.0, -50.0, 8.0], "translation": [10.895927751576597, 5.882718243455158, 49.10878113434035]}}, {"id": "right", "image_size": [64, 48], "intrinsics": {"matrix": [[60.0, 0.0, 32.0], [0.0, 60.0, 24.0], [0.0, 0.0, 1.0]], "distortion": []}, "pose": {"rotation": [1.6, 0.1, -0.2], "position": [-1.0, -50.0, 8.0], "translation": [10.895927751576597, 5.882718243455158, 49.10878113434035]}}]', 'null', '{"left": {"moved": null, "drift": {"rotation_deg": 0.0, "position_m": 0.0, "pixels": 0.0}, "drift_since": 1}, "right": {"moved": null, "drift": {"rotation_deg": 0.0, "position_m": 0.0, "pixels": 0.0}, "drift_since": 1}}', 'anyone', '127.0.0.1', 'ae35ab148d0b48cd8e43a7b5e992df7a', NULL);
INSERT INTO public.revisions VALUES (6, 'partly', 1, '2026-11-27 04:06:02.055698+00', 'put', NULL, NULL, NULL, '[{"id": "left", "image_size": [64, 48], "intrinsics": {"matrix": [[60.0, 0.0, 32.0], [0.0, 60.0, 24.0], [0.0, 0.0, 1.0]], "distortion": []}, "pose": {"rotation": [1.6, 0.1, -0.2], "position": [-1.0, -50.0, 8.0], "translation": [10.895927751576597, 5.882718243455158, 49.10878113434035]}}, {"id": "right", "image_size": [64, 48], "intrinsics": {"matrix": [[60.0, 0.0, 32.0], [0.0, 60.0, 24.0], [0.0, 0.0, 1.0]], "distortion": []}, "pose": {"rotation": [1.6, 0.1, -0.2], "position": [-1.0, -50.0, 8.0], "translation": [10.895927751576597, 5.882718243455158, 49.10878113434035]}}]', 'null', '{"left": {"moved": null, "drift": {"rotation_deg": 0.0, "position_m": 0.0, "pixels": 0.0}, "drift_since": 1}, "right": {"moved": null, "drift": {"rotation_deg": 0.0, "position_m": 0.0, "pixels": 0.0}, "drift_since": 1}}', 'anyone', '127.0.0.1', '551dfb29aca944e399e18aa0ee7d181c', NULL);
INSERT INTO public.revisions VALUES (7, 'fail', 1, '2026-11-27 04:06:03.062344+00', 'put', NULL, NULL, NULL, '[{"id": "left", "image_size": [64, 48], "intrinsics": {"matrix": [[60.0, 0.0, 32.0], [0.0, 60.0, 24.0], [0.0, 0.0, 1.0]], "distortion": []}, "pose": {"rotation": [1.6, 0.1, -0.2], "position": [-1.0, -50.0, 8.0], "translation": [10.895927751576597, 5.882718243455158, 49.10878113434035]}}, {"id": "right", "image_size": [64, 48], "intrinsics": {"matrix": [[60.0, 0.0, 32.0], [0.0, 60.0, 24.0], [0.0, 0.0, 1.0]], "distortion": []}, "pose": {"rotation": [1.6, 0.1, -0.2], "position": [-1.0, -50.0, 8.0], "translation": [10.895927751576597, 5.882718243455158, 49.10878113434035]}}]', 'null', '{"left": {"moved": null, "drift": {"rotation_deg": 0.0, "position_m": 0.0, "pixels": 0.0}, "drift_since": 1}, "right": {"moved": null, "drift": {"rotation_deg": 0.0, "position_m": 0.0, "pixels": 0.0}, "drift_since": 1}}', 'anyone', '127.0.0.1', '7a18f1ec5776465386a05c5c5e8b71c0', NULL);
INSERT INTO public.revisions VALUES (8, 'knock', 1, '2026-11-27 04:06:03.323847+00', 'put', NULL, NULL, NULL, '[{"id": "left", "image_size": [64, 48], "intrinsics": {"matrix": [[60.0, 0.0, 32.0], [0.0, 60.0, 24.0], [0.0, 0.0, 1.0]], "distortion": []}, "pose": {"rotation": [1.6, 0.1, -0.2], "position": [-1.0, -50.0, 8.0], "translation": [10.895927751576597, 5.882718243455158, 49.10878113434035]}}, {"id": "right", "image_size": [64, 48], "intrinsics": {"matrix": [[60.0, 0.0, 32.0], [0.0, 60.0, 24.0], [0.0, 0.0, 1.0]], "distortion": []}, "pose": {"rotation": [1.6, 0.1, -0.2], "position": [-1.0, -50.0, 8.0], "translation": [10.895927751576597, 5.882718243455158, 49.10878113434035]}}]', 'null', '{"left": {"moved": null, "drift": {"rotation_deg": 0.0, "position_m": 0.0, "pixels": 0.0}, "drift_since": 1}, "right": {"moved": null, "drift": {"rotation_deg": 0.0, "position_m": 0.0, "pixels": 0.0}, "drift_since": 1}}', 'anyone', '127.0.0.1', 'a1bfd8437f524fd18c0ad46e5f83d68d', NULL);
INSERT INTO public.revisions VALUES (10, 'contradict', 1, '2026-11-27 04:06:04.140076+00', 'put', NULL, NULL, NULL, '[{"id": "left", "image_size": [64, 48], "intrinsics": {"matrix": [[60.0, 0.0, 32.0], [0.0, 60.0, 24.0], [0.0, 0.0, 1.0]], "distortion": []}, "pose": {"rotation": [1.6, 0.1, -0.2], "position": [-1.0, -50.0, 8.0], "translation": [10.895927751576597, 5.882718243455158, 49.10878113434035]}}, {"id": "right", "image_size": [64, 48], "intrinsics": {"matrix": [[60.0, 0.0, 32.0], [0.0, 60.0, 24.0], [0.0, 0.0, 1.0]], "distortion": []}, "pose": {"rotation": [1.6, 0.1, -0.2], "position": [-1.0, -50.0, 8.0], "translation": [10.895927751576597, 5.882718243455158, 49.10878113434035]}}]', 'null', '{"left": {"moved": null, "drift": {"rotation_deg": 0.0, "position_m": 0.0, "pixels": 0.0}, "drift_since": 1}, "right": {"moved": null, "drift": {"rotation_deg": 0.0, "position_m": 0.0, "pixels": 0.0}, "drift_since": 1}}', 'anyone', '127.0.0.1', '6f7107c6e35b4dc193c77acf9b7a273d', NULL);
INSERT INTO public.revisions VALUES (9, 'knock', 2, '2026-11-27 04:06:04.002956+00', 'calibrated', '01M8DJX1B9TPHVCW82SFCG4BC6', NULL, 0.2, '[{"id": "left", "image_size": [64, 48], "intrinsics": {"matrix": [[60.0, 0.0, 32.0], [0.0, 60.0, 24.0], [0.0, 0.0, 1.0]], "distortion": []}, "pose": {"rotation": [1.6, 0.1, -0.2], "position": [-0.875, -43.75, 7.0], "translation": [9.533936782629521, 5.147378463023262, 42.97018349254782]}}, {"id": "right", "image_size": [64, 48], "intrinsics": {"matrix": [[60.0, 0.0, 32.0], [0.0, 60.0, 24.0], [0.0, 0.0, 1.0]], "distortion": []}, "pose": {"rotation": [1.6, 0.1, -0.2], "position": [-1.0, -50.0, 8.0], "translation": [10.895927751576597, 5.882718243455158, 49.10878113434035]}}]', 'null', '{"left": {"moved": {"rotation_deg": 0.0, "position_m": 6.3307286310503, "pixels": 1.9838683658745522}, "drift": {"rotation_deg": 0.0, "position_m": 6.3307286310503, "pixels": 1.9838683658745522}, "drift_since": 1}, "right": {"moved": {"rotation_deg": 0.0, "position_m": 0.0, "pixels": 0.0}, "drift": {"rotation_deg": 0.0, "position_m": 0.0, "pixels": 0.0}, "drift_since": 1}}', 'anyone', '127.0.0.1', '75795ab0c6ba4771a4ee54493f551c14', NULL);
INSERT INTO public.revisions VALUES (11, 'contradict', 2, '2026-11-27 04:06:05.015394+00', 'calibrated', '01M8DJX26QQMBWQ1Q4D8YDTW9D', NULL, 0.2, '[{"id": "left", "image_size": [64, 48], "intrinsics": {"matrix": [[60.0, 0.0, 32.0], [0.0, 60.0, 24.0], [0.0, 0.0, 1.0]], "distortion": []}, "pose": {"rotation": [1.6, 0.1, -0.2], "position": [-0.875, -43.75, 7.0], "translation": [9.533936782629521, 5.147378463023262, 42.97018349254782]}}, {"id": "right", "image_size": [64, 48], "intrinsics": {"matrix": [[60.0, 0.0, 32.0], [0.0, 60.0, 24.0], [0.0, 0.0, 1.0]], "distortion": []}, "pose": {"rotation": [1.6, 0.1, -0.2], "position": [-0.875, -43.75, 7.0], "translation": [9.533936782629521, 5.147378463023262, 42.97018349254782]}}]', 'null', '{"left": {"moved": {"rotation_deg": 0.0, "position_m": 6.3307286310503, "pixels": 1.9838683658745522}, "drift": {"rotation_deg": 0.0, "position_m": 6.3307286310503, "pixels": 1.9838683658745522}, "drift_since": 1}, "right": {"moved": {"rotation_deg": 0.0, "position_m": 6.3307286310503, "pixels": 1.9838683658745522}, "drift": {"rotation_deg": 0.0, "position_m": 6.3307286310503, "pixels": 1.9838683658745522}, "drift_since": 1}}', 'anyone', '127.0.0.1', '922fb976601e45349de59db64609b8e5', NULL);
INSERT INTO public.revisions VALUES (12, 'waiting', 1, '2026-11-27 04:06:29.279811+00', 'put', NULL, NULL, NULL, '[{"id": "left", "image_size": [64, 48], "intrinsics": {"matrix": [[60.0, 0.0, 32.0], [0.0, 60.0, 24.0], [0.0, 0.0, 1.0]], "distortion": []}, "pose": {"rotation": [1.6, 0.1, -0.2], "position": [-1.0, -50.0, 8.0], "translation": [10.895927751576597, 5.882718243455158, 49.10878113434035]}}, {"id": "right", "image_size": [64, 48], "intrinsics": {"matrix": [[60.0, 0.0, 32.0], [0.0, 60.0, 24.0], [0.0, 0.0, 1.0]], "distortion": []}, "pose": {"rotation": [1.6, 0.1, -0.2], "position": [-1.0, -50.0, 8.0], "translation": [10.895927751576597, 5.882718243455158, 49.10878113434035]}}]', 'null', '{"left": {"moved": null, "drift": {"rotation_deg": 0.0, "position_m": 0.0, "pixels": 0.0}, "drift_since": 1}, "right": {"moved": null, "drift": {"rotation_deg": 0.0, "position_m": 0.0, "pixels": 0.0}, "drift_since": 1}}', 'anyone', '127.0.0.1', '7795bd8c61ac4f7895c840de29093444', NULL);
INSERT INTO public.revisions VALUES (13, 'cancelled', 1, '2026-11-27 04:06:29.955837+00', 'put', NULL, NULL, NULL, '[{"id": "left", "image_size": [64, 48], "intrinsics": {"matrix": [[60.0, 0.0, 32.0], [0.0, 60.0, 24.0], [0.0, 0.0, 1.0]], "distortion": []}, "pose": {"rotation": [1.6, 0.1, -0.2], "position": [-1.0, -50.0, 8.0], "translation": [10.895927751576597, 5.882718243455158, 49.10878113434035]}}, {"id": "right", "image_size": [64, 48], "intrinsics": {"matrix": [[60.0, 0.0, 32.0], [0.0, 60.0, 24.0], [0.0, 0.0, 1.0]], "distortion": []}, "pose": {"rotation": [1.6, 0.1, -0.2], "position": [-1.0, -50.0, 8.0], "translation": [10.895927751576597, 5.882718243455158, 49.10878113434035]}}]', 'null', '{"left": {"moved": null, "drift": {"rotation_deg": 0.0, "position_m": 0.0, "pixels": 0.0}, "drift_since": 1}, "right": {"moved": null, "drift": {"rotation_deg": 0.0, "position_m": 0.0, "pixels": 0.0}, "drift_since": 1}}', 'anyone', '127.0.0.1', '7e5fd1cfc52a4db0b8180581701d7350', NULL);
INSERT INTO public.schedules VALUES ('everything', '0 3 1 1 *', 'Europe/Berlin', false, '2027-01-01 02:09:24+00', '2027-01-01 02:09:24+00', NULL, NULL, NULL, NULL, 0, false);
INSERT INTO public.tallies VALUES ('job_duration_bucket', '2.5', 1);
INSERT INTO public.tallies VALUES ('jobs_ended', 'succeeded,rejected,', 1);
INSERT INTO public.tallies VALUES ('job_duration_bucket', '0.25', 4);
INSERT INTO public.tallies VALUES ('jobs_ended', 'failed,,no-markings-in-view', 1);
INSERT INTO public.tallies VALUES ('jobs_ended', 'succeeded,partly,', 2);
INSERT INTO public.tallies VALUES ('job_duration_bucket', '0.5', 2);
INSERT INTO public.tallies VALUES ('job_duration_sum', '', 2.6148690000000006);
INSERT INTO public.tallies VALUES ('job_stitch_error_bucket', '0.2', 6);
INSERT INTO public.tallies VALUES ('job_stitch_error_sum', '', 1.2);
INSERT INTO public.tallies VALUES ('job_wait_bucket', '1', 7);
INSERT INTO public.tallies VALUES ('job_wait_sum', '', 2.323443);
INSERT INTO public.tallies VALUES ('jobs_ended', 'succeeded,accepted,', 3);
INSERT INTO public.tallies VALUES ('job_stage_bucket', 'decode,0.1', 7);
INSERT INTO public.tallies VALUES ('job_stage_sum', 'decode', 0.7);
INSERT INTO public.tallies VALUES ('other_jobs_ended', 'field,succeeded', 1);
INSERT INTO public.tallies VALUES ('other_jobs_ended', 'locate,failed', 1);
INSERT INTO public.tallies VALUES ('job_restarts', '', 0);
INSERT INTO public.tallies VALUES ('job_stage_bucket', 'evolution,0.1', 1);
INSERT INTO public.tallies VALUES ('job_stage_sum', 'evolution', 0.1);
INSERT INTO public.tallies VALUES ('other_jobs_ended', 'find,succeeded', 1);
INSERT INTO public.tallies VALUES ('jobs_ended', 'cancelled,,', 1);
INSERT INTO public.venue_quality VALUES ('everything', NULL, 1, '2026-11-27 04:06:00.826721+00', 0, 0, '{"left": {"accepted_at": "2026-11-27T04:06:00.826721Z"}, "right": {"accepted_at": "2026-11-27T04:06:00.826721Z"}}', '{"last": {"status": "succeeded", "finished_at": "2026-11-27T04:06:00.826721Z", "dry_run": false, "verdict": "accepted", "stitch_error_px": 0.2, "moved_px": 1.0}, "errors": [0.2, 0.2]}', NULL);
INSERT INTO public.venue_quality VALUES ('reject', 10, 1, NULL, 0, 1, '{"left": {"rejected_in_a_row": 1}, "right": {"rejected_in_a_row": 1}}', '{"last": {"status": "succeeded", "finished_at": "2026-11-27T04:06:01.851813Z", "dry_run": false, "verdict": "rejected", "stitch_error_px": 0.2, "moved_px": 1.0}, "errors": [0.2]}', NULL);
INSERT INTO public.venue_quality VALUES ('partly', 10, 1, NULL, 0, 0, NULL, '{"last": {"status": "succeeded", "finished_at": "2026-11-27T04:06:02.805586Z", "dry_run": true, "verdict": "partly", "stitch_error_px": 0.2, "moved_px": 1.0}, "errors": [0.2]}', NULL);
INSERT INTO public.venue_quality VALUES ('fail', NULL, NULL, NULL, 0, 1, '{"left": {"rejected_in_a_row": 1}, "right": {"rejected_in_a_row": 1}}', '{"last": {"status": "failed", "finished_at": "2026-11-27T04:06:03.281780Z", "dry_run": false}}', NULL);
INSERT INTO public.venue_quality VALUES ('knock', 0.2, 400, '2026-11-27 04:06:04.002956+00', 1.9838683658745522, 0, '{"right": {"rejected_in_a_row": 1}, "left": {"accepted_at": "2026-11-27T04:06:04.002956Z"}}', '{"last": {"status": "succeeded", "finished_at": "2026-11-27T04:06:04.002956Z", "dry_run": false, "verdict": "partly", "stitch_error_px": 0.2, "moved_px": 400.0}, "errors": [0.2]}', NULL);
INSERT INTO public.venue_quality VALUES ('contradict', 0.2, 1, '2026-11-27 04:06:05.015394+00', 1.9838683658745522, 0, '{"left": {"accepted_at": "2026-11-27T04:06:05.015394Z"}, "right": {"accepted_at": "2026-11-27T04:06:05.015394Z"}}', '{"last": {"status": "succeeded", "finished_at": "2026-11-27T04:06:05.015394Z", "dry_run": false, "verdict": "accepted", "stitch_error_px": 0.2, "moved_px": 1.0}, "errors": [0.2]}', NULL);
INSERT INTO public.venue_quality VALUES ('waiting', NULL, NULL, NULL, 0, 0, NULL, NULL, NULL);
INSERT INTO public.venue_quality VALUES ('cancelled', NULL, NULL, NULL, 0, 0, NULL, '{"last": {"status": "cancelled", "finished_at": "2026-11-27T04:06:30.146563Z", "dry_run": false}}', NULL);
INSERT INTO public.venues VALUES ('fail', '{"id": "fail", "name": "fail", "field": {"length_m": 105.0, "width_m": 68.0, "line_width_m": 0.12}, "cameras": [{"id": "left", "image_size": [64, 48], "intrinsics": {"matrix": [[60.0, 0.0, 32.0], [0.0, 60.0, 24.0], [0.0, 0.0, 1.0]], "distortion": []}, "pose": {"rotation": [1.6, 0.1, -0.2], "position": [-1.0, -50.0, 8.0], "translation": [10.895927751576597, 5.882718243455158, 49.10878113434035]}}, {"id": "right", "image_size": [64, 48], "intrinsics": {"matrix": [[60.0, 0.0, 32.0], [0.0, 60.0, 24.0], [0.0, 0.0, 1.0]], "distortion": []}, "pose": {"rotation": [1.6, 0.1, -0.2], "position": [-1.0, -50.0, 8.0], "translation": [10.895927751576597, 5.882718243455158, 49.10878113434035]}}]}', '2026-11-27 04:06:03.059019+00', NULL);
INSERT INTO public.venues VALUES ('everything', '{"id": "everything", "name": "refine", "field": {"length_m": 105.0, "width_m": 68.0, "line_width_m": 0.12, "ridge": [[-18.5, 0.0, 0.2], [18.5, 0.0, 0.2]]}, "cameras": [{"id": "left", "image_size": [64, 48], "intrinsics": {"matrix": [[60.0, 0.0, 32.0], [0.0, 60.0, 24.0], [0.0, 0.0, 1.0]], "distortion": []}, "pose": {"rotation": [1.6, 0.1, -0.2], "position": [-1.0, -50.0, 8.0], "translation": [10.895927751576597, 5.882718243455158, 49.10878113434035]}, "ignore": [[[0.0, 40.0], [20.0, 40.0], [20.0, 47.0]]], "source": "http://***@example.com/a.jpg"}, {"id": "right", "image_size": [64, 48], "intrinsics": {"matrix": [[60.0, 0.0, 32.0], [0.0, 60.0, 24.0], [0.0, 0.0, 1.0]], "distortion": [], "sigma": {"fx": 0.5}}, "pose": {"rotation": [1.6, 0.1, -0.2], "position": [-1.0, -50.0, 8.0], "translation": [10.895927751576597, 5.882718243455158, 49.10878113434035]}, "source": "http://example.com/b.jpg"}], "accept": "all", "lens": "may-drift", "alarms": {"moved_since_first_px": 40.0, "rejected_in_a_row": 1, "callback_url": "https://example.com/alarms"}, "schedule": {"cron": "0 3 1 1 *", "time_zone": "Europe/Berlin", "options": {"seed": 3}}, "webhooks": [{"url": "https://example.com/told", "events": ["poses.changed", "venue.*"]}]}', '2026-11-27 04:06:01.025438+00', '{"own": {"view": {"projection": "cylinder", "width_px": 1280}, "recover": "accept"}, "of_parts": {"alarms": {"trend_m": 0.2, "knocked": true}, "schedule": {"frames": 2, "spacing_s": 7.0}, "field": {"uneven_m": 0.004, "sigma": {"width_m": 0.2}}}, "of_cameras": {"left": {"light": {"gain": [1.06, 1.0, 0.94], "contrast": 0.1}}}}');
INSERT INTO public.venues VALUES ('reject', '{"id": "reject", "name": "reject", "field": {"length_m": 105.0, "width_m": 68.0, "line_width_m": 0.12}, "cameras": [{"id": "left", "image_size": [64, 48], "intrinsics": {"matrix": [[60.0, 0.0, 32.0], [0.0, 60.0, 24.0], [0.0, 0.0, 1.0]], "distortion": []}, "pose": {"rotation": [1.6, 0.1, -0.2], "position": [-1.0, -50.0, 8.0], "translation": [10.895927751576597, 5.882718243455158, 49.10878113434035]}}, {"id": "right", "image_size": [64, 48], "intrinsics": {"matrix": [[60.0, 0.0, 32.0], [0.0, 60.0, 24.0], [0.0, 0.0, 1.0]], "distortion": []}, "pose": {"rotation": [1.6, 0.1, -0.2], "position": [-1.0, -50.0, 8.0], "translation": [10.895927751576597, 5.882718243455158, 49.10878113434035]}}]}', '2026-11-27 04:06:01.228455+00', NULL);
INSERT INTO public.venues VALUES ('partly', '{"id": "partly", "name": "partly", "field": {"length_m": 105.0, "width_m": 68.0, "line_width_m": 0.12}, "cameras": [{"id": "left", "image_size": [64, 48], "intrinsics": {"matrix": [[60.0, 0.0, 32.0], [0.0, 60.0, 24.0], [0.0, 0.0, 1.0]], "distortion": []}, "pose": {"rotation": [1.6, 0.1, -0.2], "position": [-1.0, -50.0, 8.0], "translation": [10.895927751576597, 5.882718243455158, 49.10878113434035]}}, {"id": "right", "image_size": [64, 48], "intrinsics": {"matrix": [[60.0, 0.0, 32.0], [0.0, 60.0, 24.0], [0.0, 0.0, 1.0]], "distortion": []}, "pose": {"rotation": [1.6, 0.1, -0.2], "position": [-1.0, -50.0, 8.0], "translation": [10.895927751576597, 5.882718243455158, 49.10878113434035]}}]}', '2026-11-27 04:06:02.050735+00', NULL);
INSERT INTO public.venues VALUES ('knock', '{"id": "knock", "name": "knock", "field": {"length_m": 105.0, "width_m": 68.0, "line_width_m": 0.12}, "cameras": [{"id": "left", "image_size": [64, 48], "intrinsics": {"matrix": [[60.0, 0.0, 32.0], [0.0, 60.0, 24.0], [0.0, 0.0, 1.0]], "distortion": []}, "pose": {"rotation": [1.6, 0.1, -0.2], "position": [-0.875, -43.75, 7.0], "translation": [9.533936782629521, 5.147378463023262, 42.97018349254782]}}, {"id": "right", "image_size": [64, 48], "intrinsics": {"matrix": [[60.0, 0.0, 32.0], [0.0, 60.0, 24.0], [0.0, 0.0, 1.0]], "distortion": []}, "pose": {"rotation": [1.6, 0.1, -0.2], "position": [-1.0, -50.0, 8.0], "translation": [10.895927751576597, 5.882718243455158, 49.10878113434035]}}]}', '2026-11-27 04:06:04.002956+00', NULL);
INSERT INTO public.venues VALUES ('contradict', '{"id": "contradict", "name": "contradict", "field": {"length_m": 105.0, "width_m": 68.0, "line_width_m": 0.12}, "cameras": [{"id": "left", "image_size": [64, 48], "intrinsics": {"matrix": [[60.0, 0.0, 32.0], [0.0, 60.0, 24.0], [0.0, 0.0, 1.0]], "distortion": []}, "pose": {"rotation": [1.6, 0.1, -0.2], "position": [-0.875, -43.75, 7.0], "translation": [9.533936782629521, 5.147378463023262, 42.97018349254782]}}, {"id": "right", "image_size": [64, 48], "intrinsics": {"matrix": [[60.0, 0.0, 32.0], [0.0, 60.0, 24.0], [0.0, 0.0, 1.0]], "distortion": []}, "pose": {"rotation": [1.6, 0.1, -0.2], "position": [-0.875, -43.75, 7.0], "translation": [9.533936782629521, 5.147378463023262, 42.97018349254782]}}]}', '2026-11-27 04:06:05.015394+00', NULL);
INSERT INTO public.venues VALUES ('waiting', '{"id": "waiting", "name": "accept", "field": {"length_m": 105.0, "width_m": 68.0, "line_width_m": 0.12}, "cameras": [{"id": "left", "image_size": [64, 48], "intrinsics": {"matrix": [[60.0, 0.0, 32.0], [0.0, 60.0, 24.0], [0.0, 0.0, 1.0]], "distortion": []}, "pose": {"rotation": [1.6, 0.1, -0.2], "position": [-1.0, -50.0, 8.0], "translation": [10.895927751576597, 5.882718243455158, 49.10878113434035]}}, {"id": "right", "image_size": [64, 48], "intrinsics": {"matrix": [[60.0, 0.0, 32.0], [0.0, 60.0, 24.0], [0.0, 0.0, 1.0]], "distortion": []}, "pose": {"rotation": [1.6, 0.1, -0.2], "position": [-1.0, -50.0, 8.0], "translation": [10.895927751576597, 5.882718243455158, 49.10878113434035]}}]}', '2026-11-27 04:06:29.251852+00', NULL);
INSERT INTO public.venues VALUES ('cancelled', '{"id": "cancelled", "name": "accept", "field": {"length_m": 105.0, "width_m": 68.0, "line_width_m": 0.12}, "cameras": [{"id": "left", "image_size": [64, 48], "intrinsics": {"matrix": [[60.0, 0.0, 32.0], [0.0, 60.0, 24.0], [0.0, 0.0, 1.0]], "distortion": []}, "pose": {"rotation": [1.6, 0.1, -0.2], "position": [-1.0, -50.0, 8.0], "translation": [10.895927751576597, 5.882718243455158, 49.10878113434035]}}, {"id": "right", "image_size": [64, 48], "intrinsics": {"matrix": [[60.0, 0.0, 32.0], [0.0, 60.0, 24.0], [0.0, 0.0, 1.0]], "distortion": []}, "pose": {"rotation": [1.6, 0.1, -0.2], "position": [-1.0, -50.0, 8.0], "translation": [10.895927751576597, 5.882718243455158, 49.10878113434035]}}]}', '2026-11-27 04:06:29.943062+00', NULL);
INSERT INTO public.workers VALUES ('vm', '2f782beca6c497e09ee1b67bd6a1202048f19e97f7e1364a58d415ce7b3ecd9e', '2026-11-27 04:05:56.132141+00', '2026-11-27 04:06:06.404173+00', '5f8108e0cd8946158b058043d51797c6', NULL, '0.2.0', 0);
SELECT pg_catalog.setval('public.camera_trend_id_seq', 7, true);
SELECT pg_catalog.setval('public.events_id_seq', 44, true);
SELECT pg_catalog.setval('public.revisions_id_seq', 13, true);
ALTER TABLE ONLY dbos.application_versions
    ADD CONSTRAINT application_versions_pkey PRIMARY KEY (version_id);
ALTER TABLE ONLY dbos.application_versions
    ADD CONSTRAINT application_versions_version_name_key UNIQUE (version_name);
ALTER TABLE ONLY dbos.dbos_migrations
    ADD CONSTRAINT dbos_migrations_pkey PRIMARY KEY (version);
ALTER TABLE ONLY dbos.event_dispatch_kv
    ADD CONSTRAINT event_dispatch_kv_pkey PRIMARY KEY (service_name, workflow_fn_name, key);
ALTER TABLE ONLY dbos.notifications
    ADD CONSTRAINT notifications_pkey PRIMARY KEY (message_uuid);
ALTER TABLE ONLY dbos.operation_outputs
    ADD CONSTRAINT operation_outputs_pkey PRIMARY KEY (workflow_uuid, function_id);
ALTER TABLE ONLY dbos.queues
    ADD CONSTRAINT queues_name_key UNIQUE (name);
ALTER TABLE ONLY dbos.queues
    ADD CONSTRAINT queues_pkey PRIMARY KEY (queue_id);
ALTER TABLE ONLY dbos.streams
    ADD CONSTRAINT streams_pkey PRIMARY KEY (workflow_uuid, key, "offset");
ALTER TABLE ONLY dbos.workflow_events_history
    ADD CONSTRAINT workflow_events_history_pkey PRIMARY KEY (workflow_uuid, function_id, key);
ALTER TABLE ONLY dbos.workflow_events
    ADD CONSTRAINT workflow_events_pkey PRIMARY KEY (workflow_uuid, key);
ALTER TABLE ONLY dbos.workflow_input
    ADD CONSTRAINT workflow_input_pkey PRIMARY KEY (workflow_uuid);
ALTER TABLE ONLY dbos.workflow_output
    ADD CONSTRAINT workflow_output_pkey PRIMARY KEY (workflow_uuid);
ALTER TABLE ONLY dbos.workflow_schedules
    ADD CONSTRAINT workflow_schedules_pkey PRIMARY KEY (schedule_id);
ALTER TABLE ONLY dbos.workflow_schedules
    ADD CONSTRAINT workflow_schedules_schedule_name_key UNIQUE (schedule_name);
ALTER TABLE ONLY dbos.workflow_status
    ADD CONSTRAINT workflow_status_pkey PRIMARY KEY (workflow_uuid);
ALTER TABLE ONLY public.alarms
    ADD CONSTRAINT alarms_pkey PRIMARY KEY (venue, rule, camera);
ALTER TABLE ONLY public.api_keys
    ADD CONSTRAINT api_keys_pkey PRIMARY KEY (name);
ALTER TABLE ONLY public.camera_anchors
    ADD CONSTRAINT camera_anchors_pkey PRIMARY KEY (venue, camera, revision);
ALTER TABLE ONLY public.camera_trend
    ADD CONSTRAINT camera_trend_pkey PRIMARY KEY (id);
ALTER TABLE ONLY public.credentials
    ADD CONSTRAINT credentials_pkey PRIMARY KEY (venue, camera);
ALTER TABLE ONLY public.deliveries
    ADD CONSTRAINT deliveries_pkey PRIMARY KEY (id);
ALTER TABLE ONLY public.esc_schema
    ADD CONSTRAINT esc_schema_pkc PRIMARY KEY (version_num);
ALTER TABLE ONLY public.events
    ADD CONSTRAINT events_pkey PRIMARY KEY (id);
ALTER TABLE ONLY public.jobs
    ADD CONSTRAINT jobs_pkey PRIMARY KEY (id);
ALTER TABLE ONLY public.leftovers
    ADD CONSTRAINT leftovers_pkey PRIMARY KEY (folder);
ALTER TABLE ONLY public.live_minutes
    ADD CONSTRAINT live_minutes_pkey PRIMARY KEY (venue, minute);
ALTER TABLE ONLY public.live_reports
    ADD CONSTRAINT live_reports_pkey PRIMARY KEY (venue);
ALTER TABLE ONLY public.memories
    ADD CONSTRAINT memories_pkey PRIMARY KEY (venue, revision);
ALTER TABLE ONLY public.revisions
    ADD CONSTRAINT revisions_pkey PRIMARY KEY (id);
ALTER TABLE ONLY public.schedules
    ADD CONSTRAINT schedules_pkey PRIMARY KEY (venue);
ALTER TABLE ONLY public.sessions
    ADD CONSTRAINT sessions_pkey PRIMARY KEY (hash);
ALTER TABLE ONLY public.tallies
    ADD CONSTRAINT tallies_pkey PRIMARY KEY (metric, labels);
ALTER TABLE ONLY public.venue_quality
    ADD CONSTRAINT venue_quality_pkey PRIMARY KEY (venue);
ALTER TABLE ONLY public.venues
    ADD CONSTRAINT venues_pkey PRIMARY KEY (id);
ALTER TABLE ONLY public.workers
    ADD CONSTRAINT workers_pkey PRIMARY KEY (name);
CREATE INDEX idx_application_versions_owner_timestamp ON dbos.application_versions USING btree (application_name, version_timestamp DESC);
CREATE INDEX idx_application_versions_timestamp ON dbos.application_versions USING btree (version_timestamp DESC);
CREATE INDEX idx_operation_outputs_completed_at_function_name_v2 ON dbos.operation_outputs USING btree (completed_at_epoch_ms, function_name) INCLUDE (application_name);
CREATE INDEX idx_operation_outputs_retention ON dbos.operation_outputs USING btree (retention_timestamp);
CREATE INDEX idx_workflow_input_retention ON dbos.workflow_input USING btree (retention_timestamp);
CREATE INDEX idx_workflow_output_retention ON dbos.workflow_output USING btree (retention_timestamp);
CREATE INDEX idx_workflow_status_attributes ON dbos.workflow_status USING gin (attributes) WHERE (attributes IS NOT NULL);
CREATE INDEX idx_workflow_status_completed_at ON dbos.workflow_status USING btree (completed_at) WHERE (completed_at IS NOT NULL);
CREATE INDEX idx_workflow_status_deadline ON dbos.workflow_status USING btree (workflow_deadline_epoch_ms) WHERE ((status = ANY (ARRAY['ENQUEUED'::text, 'PENDING'::text, 'DELAYED'::text])) AND (workflow_deadline_epoch_ms IS NOT NULL));
CREATE INDEX idx_workflow_status_delayed ON dbos.workflow_status USING btree (delay_until_epoch_ms) WHERE (status = 'DELAYED'::text);
CREATE INDEX idx_workflow_status_failed ON dbos.workflow_status USING btree (status, created_at) WHERE (status = ANY (ARRAY['ERROR'::text, 'CANCELLED'::text, 'MAX_RECOVERY_ATTEMPTS_EXCEEDED'::text]));
CREATE INDEX idx_workflow_status_forked_from ON dbos.workflow_status USING btree (forked_from) WHERE (forked_from IS NOT NULL);
CREATE INDEX idx_workflow_status_in_flight_v2 ON dbos.workflow_status USING btree (queue_name, status, priority, created_at) INCLUDE (application_name) WHERE (status = ANY (ARRAY['ENQUEUED'::text, 'PENDING'::text]));
CREATE INDEX idx_workflow_status_parent_workflow_id ON dbos.workflow_status USING btree (parent_workflow_id) WHERE (parent_workflow_id IS NOT NULL);
CREATE INDEX idx_workflow_status_partition_dequeue_v3 ON dbos.workflow_status USING btree (queue_name, status, queue_partition_key, priority, created_at, workflow_uuid) INCLUDE (application_name) WHERE ((status = ANY (ARRAY['ENQUEUED'::text, 'PENDING'::text])) AND (queue_partition_key IS NOT NULL));
CREATE INDEX idx_workflow_status_pending ON dbos.workflow_status USING btree (created_at) WHERE (status = 'PENDING'::text);
CREATE INDEX idx_workflow_status_rate_limited ON dbos.workflow_status USING btree (queue_name, started_at_epoch_ms) WHERE (rate_limited = true);
CREATE INDEX idx_workflow_status_schedule_name ON dbos.workflow_status USING btree (schedule_name) WHERE (schedule_name IS NOT NULL);
CREATE INDEX idx_workflow_status_started_at ON dbos.workflow_status USING btree (started_at_epoch_ms) WHERE (started_at_epoch_ms IS NOT NULL);
CREATE INDEX idx_workflow_topic ON dbos.notifications USING btree (destination_uuid, topic);
CREATE UNIQUE INDEX uq_application_versions_owner_version ON dbos.application_versions USING btree (application_name, version_name) WHERE (application_name IS NOT NULL);
CREATE UNIQUE INDEX uq_application_versions_unclaimed_version ON dbos.application_versions USING btree (version_name) WHERE (application_name IS NULL);
CREATE UNIQUE INDEX uq_workflow_status_dedup_id ON dbos.workflow_status USING btree (queue_name, deduplication_id) WHERE (deduplication_id IS NOT NULL);
CREATE INDEX workflow_status_created_at_index ON dbos.workflow_status USING btree (created_at);
CREATE INDEX alarms_by_since ON public.alarms USING btree (since);
CREATE UNIQUE INDEX api_keys_by_hash ON public.api_keys USING btree (hash);
CREATE INDEX camera_anchors_by_move ON public.camera_anchors USING btree (moved_m);
CREATE INDEX camera_trend_by_camera ON public.camera_trend USING btree (venue, camera, id);
CREATE INDEX deliveries_by_due ON public.deliveries USING btree (status, due_at);
CREATE INDEX events_by_venue ON public.events USING btree (venue, id);
CREATE INDEX jobs_by_end ON public.jobs USING btree (finished_at);
CREATE INDEX jobs_by_status ON public.jobs USING btree (status, priority, id);
CREATE INDEX jobs_by_venue ON public.jobs USING btree (venue, id, status, kind);
CREATE INDEX jobs_of_kind ON public.jobs USING btree (kind, id);
CREATE INDEX jobs_of_kind_and_status ON public.jobs USING btree (kind, status, id);
CREATE INDEX jobs_of_status ON public.jobs USING btree (status, id);
CREATE INDEX jobs_with_frames ON public.jobs USING btree (finished_at) WHERE (frames_deleted_at IS NULL);
CREATE INDEX jobs_with_pictures ON public.jobs USING btree (finished_at) WHERE (pictures_deleted_at IS NULL);
CREATE INDEX leftovers_by_due ON public.leftovers USING btree (due_at);
CREATE INDEX live_minutes_by_minute ON public.live_minutes USING btree (minute);
CREATE INDEX live_reports_by_alarm ON public.live_reports USING btree (alarm_due_at);
CREATE UNIQUE INDEX one_active_job_per_venue ON public.jobs USING btree (venue) WHERE (((status)::text = ANY ((ARRAY['queued'::character varying, 'running'::character varying])::text[])) AND ((kind)::text = 'calibration'::text));
CREATE UNIQUE INDEX one_job_per_key ON public.jobs USING btree (venue, idempotency_key);
CREATE INDEX revisions_by_job ON public.revisions USING btree (job);
CREATE INDEX revisions_by_time ON public.revisions USING btree (cause, at);
CREATE UNIQUE INDEX revisions_by_venue ON public.revisions USING btree (venue, number);
CREATE INDEX schedules_by_look ON public.schedules USING btree (look_at);
CREATE INDEX venues_by_alarm ON public.venue_quality USING btree (alarm_due_at);
CREATE INDEX venues_by_stitch_error ON public.venue_quality USING btree (stitch_error_px);
CREATE TRIGGER dbos_notifications_trigger AFTER INSERT ON dbos.notifications FOR EACH ROW EXECUTE FUNCTION dbos.notifications_function();
ALTER TABLE ONLY dbos.notifications
    ADD CONSTRAINT notifications_destination_uuid_fkey FOREIGN KEY (destination_uuid) REFERENCES dbos.workflow_status(workflow_uuid) ON UPDATE CASCADE ON DELETE CASCADE;
ALTER TABLE ONLY dbos.streams
    ADD CONSTRAINT streams_workflow_uuid_fkey FOREIGN KEY (workflow_uuid) REFERENCES dbos.workflow_status(workflow_uuid) ON UPDATE CASCADE ON DELETE CASCADE;
ALTER TABLE ONLY dbos.workflow_events_history
    ADD CONSTRAINT workflow_events_history_workflow_uuid_fkey FOREIGN KEY (workflow_uuid) REFERENCES dbos.workflow_status(workflow_uuid) ON UPDATE CASCADE ON DELETE CASCADE;
ALTER TABLE ONLY dbos.workflow_events
    ADD CONSTRAINT workflow_events_workflow_uuid_fkey FOREIGN KEY (workflow_uuid) REFERENCES dbos.workflow_status(workflow_uuid) ON UPDATE CASCADE ON DELETE CASCADE;
