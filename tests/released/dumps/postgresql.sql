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
    last_used_at timestamp with time zone
);
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
    job character varying(26)
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
    traceparent character varying(55)
);
CREATE TABLE public.leftovers (
    folder character varying(255) NOT NULL,
    due_at timestamp with time zone NOT NULL
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
    movements json NOT NULL
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
    last_error character varying(500)
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
    updated_at timestamp with time zone NOT NULL
);
CREATE TABLE public.workers (
    name character varying(255) NOT NULL,
    model_sha256 character varying(64),
    started_at timestamp with time zone NOT NULL,
    seen_at timestamp with time zone NOT NULL
);
ALTER TABLE ONLY public.events ALTER COLUMN id SET DEFAULT nextval('public.events_id_seq'::regclass);
ALTER TABLE ONLY public.revisions ALTER COLUMN id SET DEFAULT nextval('public.revisions_id_seq'::regclass);
INSERT INTO dbos.application_versions VALUES ('78852d56-5bcf-4410-94f4-3a60963e766d', '1', 1795456533343, 1795456533343, 'esc');
INSERT INTO dbos.dbos_migrations VALUES (125);
INSERT INTO dbos.queues VALUES ('ee5dddf9-6d85-498c-bac1-8030aaa1451e', 'calibration', NULL, 1, NULL, NULL, true, false, 0.5, 1795456533424, 1795456533399, 'esc', NULL, NULL, NULL, NULL);
INSERT INTO dbos.queues VALUES ('d1da1c6f-8bd3-4002-ba57-5f79707c9f68', 'light', NULL, 1, NULL, NULL, true, false, 0.5, 1795456533491, 1795456533488, 'esc', NULL, NULL, NULL, NULL);
INSERT INTO dbos.workflow_input VALUES ('01M84RS2B0CCB0SCJXVSENDJV7', 'gASVNgAAAAAAAAB9lCiMBGFyZ3OUjBowMU04NFJTMkIwQ0NCMFNDSlhWU0VOREpWN5SFlIwGa3dhcmdzlH2UdS4=', 1795456534910);
INSERT INTO dbos.workflow_input VALUES ('01M84RS391K40T1NEXPF9TAVSC', 'gASVNgAAAAAAAAB9lCiMBGFyZ3OUjBowMU04NFJTMzkxSzQwVDFORVhQRjlUQVZTQ5SFlIwGa3dhcmdzlH2UdS4=', 1795456535882);
INSERT INTO dbos.workflow_input VALUES ('01M84RS3YNF3BKJPCAW6PN8RMJ', 'gASVNgAAAAAAAAB9lCiMBGFyZ3OUjBowMU04NFJTM1lORjNCS0pQQ0FXNlBOOFJNSpSFlIwGa3dhcmdzlH2UdS4=', 1795456536563);
INSERT INTO dbos.workflow_input VALUES ('01M84RS4XSR2YR9TMF0R2EMGNZ', 'gASVNgAAAAAAAAB9lCiMBGFyZ3OUjBowMU04NFJTNFhTUjJZUjlUTUYwUjJFTUdOWpSFlIwGa3dhcmdzlH2UdS4=', 1795456537573);
INSERT INTO dbos.workflow_input VALUES ('01M84RS5ED8FSM9HGTGTVSEB2S', 'gASVNgAAAAAAAAB9lCiMBGFyZ3OUjBowMU04NFJTNUVEOEZTTTlIR1RHVFZTRUIyU5SFlIwGa3dhcmdzlH2UdS4=', 1795456538090);
INSERT INTO dbos.workflow_input VALUES ('01M84RS5W911HX23VAFXWPKVRX', 'gASVNgAAAAAAAAB9lCiMBGFyZ3OUjBowMU04NFJTNVc5MTFIWDIzVkFGWFdQS1ZSWJSFlIwGa3dhcmdzlH2UdS4=', 1795456538528);
INSERT INTO dbos.workflow_input VALUES ('01M84RS6P8T5W240Q7J1G6MTMF', 'gASVNgAAAAAAAAB9lCiMBGFyZ3OUjBowMU04NFJTNlA4VDVXMjQwUTdKMUc2TVRNRpSFlIwGa3dhcmdzlH2UdS4=', 1795456539357);
INSERT INTO dbos.workflow_input VALUES ('01M84RSCZ092M08PMWN6QR64JA', 'gASVNgAAAAAAAAB9lCiMBGFyZ3OUjBowMU04NFJTQ1owOTJNMDhQTVdONlFSNjRKQZSFlIwGa3dhcmdzlH2UdS4=', 1795456545805);
INSERT INTO dbos.workflow_input VALUES ('01M84RSD7TTEJQDYVTH3SGTWP2', 'gASVNgAAAAAAAAB9lCiMBGFyZ3OUjBowMU04NFJTRDdUVEVKUURZVlRIM1NHVFdQMpSFlIwGa3dhcmdzlH2UdS4=', 1795456546082);
INSERT INTO dbos.workflow_output VALUES ('01M84RS2B0CCB0SCJXVSENDJV7', 'gAROLg==', NULL, 1795456535764);
INSERT INTO dbos.workflow_output VALUES ('01M84RS391K40T1NEXPF9TAVSC', 'gAROLg==', NULL, 1795456536319);
INSERT INTO dbos.workflow_output VALUES ('01M84RS3YNF3BKJPCAW6PN8RMJ', 'gAROLg==', NULL, 1795456537291);
INSERT INTO dbos.workflow_output VALUES ('01M84RS4XSR2YR9TMF0R2EMGNZ', 'gAROLg==', NULL, 1795456537877);
INSERT INTO dbos.workflow_output VALUES ('01M84RS5ED8FSM9HGTGTVSEB2S', 'gAROLg==', NULL, 1795456538412);
INSERT INTO dbos.workflow_output VALUES ('01M84RS5W911HX23VAFXWPKVRX', 'gAROLg==', NULL, 1795456538998);
INSERT INTO dbos.workflow_output VALUES ('01M84RS6P8T5W240Q7J1G6MTMF', 'gAROLg==', NULL, 1795456539972);
INSERT INTO dbos.workflow_status VALUES ('01M84RS2B0CCB0SCJXVSENDJV7', 'SUCCESS', 'calibrate', NULL, NULL, NULL, NULL, NULL, NULL, 'vm', 1795456534910, 1795456535764, '1', NULL, NULL, NULL, 1, 'calibration', NULL, NULL, NULL, 1795456535016, NULL, 100, NULL, NULL, NULL, NULL, 'py_pickle', NULL, false, false, 1795456535764, 'null', NULL, NULL, false, 'esc', 'e8040fea-ece8-404f-92ce-17d997216734');
INSERT INTO dbos.workflow_status VALUES ('01M84RS391K40T1NEXPF9TAVSC', 'SUCCESS', 'calibrate', NULL, NULL, NULL, NULL, NULL, NULL, 'vm', 1795456535882, 1795456536319, '1', NULL, NULL, NULL, 1, 'calibration', NULL, NULL, NULL, 1795456536042, NULL, 100, NULL, NULL, NULL, NULL, 'py_pickle', NULL, false, false, 1795456536319, 'null', NULL, NULL, false, 'esc', 'c3ae2de3-fce5-4333-87c8-965f5b4e8b95');
INSERT INTO dbos.workflow_status VALUES ('01M84RS3YNF3BKJPCAW6PN8RMJ', 'SUCCESS', 'calibrate', NULL, NULL, NULL, NULL, NULL, NULL, 'vm', 1795456536563, 1795456537291, '1', NULL, NULL, NULL, 1, 'calibration', NULL, NULL, NULL, 1795456537084, NULL, 100, NULL, NULL, NULL, NULL, 'py_pickle', NULL, false, false, 1795456537291, 'null', NULL, NULL, false, 'esc', '7cefc3ac-ee50-4030-a0f3-2edb8027ef40');
INSERT INTO dbos.workflow_status VALUES ('01M84RS4XSR2YR9TMF0R2EMGNZ', 'SUCCESS', 'calibrate', NULL, NULL, NULL, NULL, NULL, NULL, 'vm', 1795456537573, 1795456537877, '1', NULL, NULL, NULL, 1, 'calibration', NULL, NULL, NULL, 1795456537634, NULL, 100, NULL, NULL, NULL, NULL, 'py_pickle', NULL, false, false, 1795456537877, 'null', NULL, NULL, false, 'esc', 'b50ab8c4-bd60-419b-8a38-655c2e5cc08f');
INSERT INTO dbos.workflow_status VALUES ('01M84RS5ED8FSM9HGTGTVSEB2S', 'SUCCESS', 'calibrate', NULL, NULL, NULL, NULL, NULL, NULL, 'vm', 1795456538090, 1795456538412, '1', NULL, NULL, NULL, 1, 'calibration', NULL, NULL, NULL, 1795456538171, NULL, 100, NULL, NULL, NULL, NULL, 'py_pickle', NULL, false, false, 1795456538412, 'null', NULL, NULL, false, 'esc', '7b1beeda-b017-44f6-9ad6-8dcffa90dc40');
INSERT INTO dbos.workflow_status VALUES ('01M84RS5W911HX23VAFXWPKVRX', 'SUCCESS', 'calibrate', NULL, NULL, NULL, NULL, NULL, NULL, 'vm', 1795456538528, 1795456538998, '1', NULL, NULL, NULL, 1, 'calibration', NULL, NULL, NULL, 1795456538718, NULL, 100, NULL, NULL, NULL, NULL, 'py_pickle', NULL, false, false, 1795456538998, 'null', NULL, NULL, false, 'esc', 'f8f41416-a132-45da-8abf-6521c8a264d5');
INSERT INTO dbos.workflow_status VALUES ('01M84RS6P8T5W240Q7J1G6MTMF', 'SUCCESS', 'calibrate', NULL, NULL, NULL, NULL, NULL, NULL, 'vm', 1795456539357, 1795456539972, '1', NULL, NULL, NULL, 1, 'light', NULL, NULL, NULL, 1795456539770, NULL, 100, NULL, NULL, NULL, NULL, 'py_pickle', NULL, false, false, 1795456539972, 'null', NULL, NULL, false, 'esc', '1cd34924-8079-4d02-ad63-c82b6f3ea316');
INSERT INTO dbos.workflow_status VALUES ('01M84RSCZ092M08PMWN6QR64JA', 'ENQUEUED', 'calibrate', NULL, NULL, NULL, NULL, NULL, NULL, NULL, 1795456545805, 1795456545805, NULL, NULL, NULL, NULL, 0, 'calibration', NULL, NULL, NULL, NULL, NULL, 100, NULL, NULL, NULL, NULL, 'py_pickle', NULL, false, false, NULL, 'null', NULL, NULL, false, 'esc', '297bd491-6acd-4d16-b5e9-ca6c6352aad3');
INSERT INTO dbos.workflow_status VALUES ('01M84RSD7TTEJQDYVTH3SGTWP2', 'ENQUEUED', 'calibrate', NULL, NULL, NULL, NULL, NULL, NULL, NULL, 1795456546082, 1795456546082, NULL, NULL, NULL, NULL, 0, 'calibration', NULL, NULL, NULL, NULL, NULL, 100, NULL, NULL, NULL, NULL, 'py_pickle', NULL, false, false, NULL, 'null', NULL, NULL, false, 'esc', 'a2b67b32-e3d1-43c3-b7f9-265d3ab7d139');
INSERT INTO public.credentials VALUES ('everything', 'left', 'u:p');
INSERT INTO public.deliveries VALUES ('01M84RS1XFXKHX23GVYPZS2WP2', 'https://example.com/told', 'example.com', 'waiting', 1, '2026-11-23 17:55:40.955591+00', 'example.com cannot be looked up: [Errno -2] Name or service not known', 1);
INSERT INTO public.deliveries VALUES ('01M84RS28PQMJFZWBBWVBNXAGG', 'https://example.com/told', 'example.com', 'waiting', 1, '2026-11-23 17:55:40.707917+00', 'example.com cannot be looked up: [Errno -2] Name or service not known', 2);
INSERT INTO public.deliveries VALUES ('01M84RS31FZGFZ091BJJBXYR8K', 'https://example.com/told', 'example.com', 'waiting', 1, '2026-11-23 17:55:41.957802+00', 'example.com cannot be looked up: [Errno -2] Name or service not known', 4);
INSERT INTO public.deliveries VALUES ('01M84RS2B0CCB0SCJXVSENDJV7', 'https://example.com/end', 'example.com', 'waiting', 1, '2026-11-23 17:55:42.103297+00', 'example.com cannot be looked up: [Errno -2] Name or service not known', NULL);
INSERT INTO public.deliveries VALUES ('01M84RS3W087PVX3CZH6QXVMB8', 'https://example.com/told', 'example.com', 'waiting', 1, '2026-11-23 17:55:42.278061+00', 'example.com cannot be looked up: [Errno -2] Name or service not known', 9);
INSERT INTO public.deliveries VALUES ('01M84RS3QCWVJGK2XTJY7Z5VVW', 'https://example.com/told', 'example.com', 'waiting', 1, '2026-11-23 17:55:42.207381+00', 'example.com cannot be looked up: [Errno -2] Name or service not known', 7);
INSERT INTO public.esc_schema VALUES ('0001');
INSERT INTO public.events VALUES (1, 'everything', 'venue.created', '2026-11-23 17:55:34.438686+00', '{"venue": "everything", "changed": []}', NULL);
INSERT INTO public.events VALUES (2, 'everything', 'poses.changed', '2026-11-23 17:55:34.457164+00', '{"venue": "everything", "revision": 1, "cause": "put", "job": null, "stitch_error_px": null, "ridge": [[-18.5, 0.0, 0.2], [18.5, 0.0, 0.2]], "cameras": [{"id": "left", "image_size": [64, 48], "intrinsics": {"model": "opencv", "matrix": [[60.0, 0.0, 32.0], [0.0, 60.0, 24.0], [0.0, 0.0, 1.0]], "distortion": [], "sigma": null}, "pose": {"rotation": [1.6, 0.1, -0.2], "position": [-1.0, -50.0, 8.0], "translation": [10.895927751576597, 5.882718243455158, 49.10878113434035]}}, {"id": "right", "image_size": [64, 48], "intrinsics": {"model": "opencv", "matrix": [[60.0, 0.0, 32.0], [0.0, 60.0, 24.0], [0.0, 0.0, 1.0]], "distortion": [], "sigma": {"fx": 0.5}}, "pose": {"rotation": [1.6, 0.1, -0.2], "position": [-1.0, -50.0, 8.0], "translation": [10.895927751576597, 5.882718243455158, 49.10878113434035]}}], "changed": ["left", "right"]}', NULL);
INSERT INTO public.events VALUES (3, 'everything', 'job.queued', '2026-11-23 17:55:34.913279+00', NULL, '01M84RS2B0CCB0SCJXVSENDJV7');
INSERT INTO public.events VALUES (4, 'everything', 'poses.changed', '2026-11-23 17:55:35.408449+00', '{"venue": "everything", "revision": 2, "cause": "calibrated", "job": "01M84RS2B0CCB0SCJXVSENDJV7", "stitch_error_px": 0.2, "ridge": [[-18.5, 0.0, 0.2], [18.5, 0.0, 0.2]], "cameras": [{"id": "left", "image_size": [64, 48], "intrinsics": {"model": "opencv", "matrix": [[60.0, 0.0, 32.0], [0.0, 60.0, 24.0], [0.0, 0.0, 1.0]], "distortion": [], "sigma": null}, "pose": {"rotation": [1.6, 0.1, -0.2], "position": [-0.875, -43.75, 7.0], "translation": [9.533936782629523, 5.147378463023263, 42.970183492547804]}}, {"id": "right", "image_size": [64, 48], "intrinsics": {"model": "opencv", "matrix": [[60.0, 0.0, 32.0], [0.0, 60.0, 24.0], [0.0, 0.0, 1.0]], "distortion": [], "sigma": {"fx": 0.5}}, "pose": {"rotation": [1.6, 0.1, -0.2], "position": [-0.875, -43.75, 7.0], "translation": [9.533936782629523, 5.147378463023263, 42.970183492547804]}}], "changed": ["left", "right"]}', NULL);
INSERT INTO public.events VALUES (5, 'everything', 'job.succeeded', '2026-11-23 17:55:35.684409+00', NULL, '01M84RS2B0CCB0SCJXVSENDJV7');
INSERT INTO public.events VALUES (6, 'everything', 'job.queued', '2026-11-23 17:55:35.892155+00', NULL, '01M84RS391K40T1NEXPF9TAVSC');
INSERT INTO public.events VALUES (7, 'everything', 'poses.changed', '2026-11-23 17:55:36.294331+00', '{"venue": "everything", "revision": 3, "cause": "calibrated", "job": "01M84RS391K40T1NEXPF9TAVSC", "stitch_error_px": 0.2, "ridge": [[-18.5, 0.0, 0.2], [18.5, 0.0, 0.2]], "cameras": [{"id": "left", "image_size": [64, 48], "intrinsics": {"model": "opencv", "matrix": [[60.0, 0.0, 32.0], [0.0, 60.0, 24.0], [0.0, 0.0, 1.0]], "distortion": [], "sigma": null}, "pose": {"rotation": [1.6, 0.1, -0.2], "position": [-0.765625, -38.28125, 6.125], "translation": [8.342194684800832, 4.503956155145355, 37.59891055597933]}}, {"id": "right", "image_size": [64, 48], "intrinsics": {"model": "opencv", "matrix": [[60.0, 0.0, 32.0], [0.0, 60.0, 24.0], [0.0, 0.0, 1.0]], "distortion": [], "sigma": {"fx": 0.5}}, "pose": {"rotation": [1.6, 0.1, -0.2], "position": [-0.765625, -38.28125, 6.125], "translation": [8.342194684800832, 4.503956155145355, 37.59891055597933]}}], "changed": ["left", "right"]}', NULL);
INSERT INTO public.events VALUES (8, 'everything', 'job.succeeded', '2026-11-23 17:55:36.304638+00', NULL, '01M84RS391K40T1NEXPF9TAVSC');
INSERT INTO public.events VALUES (9, 'everything', 'poses.changed', '2026-11-23 17:55:36.392774+00', '{"venue": "everything", "revision": 4, "cause": "restored", "job": null, "stitch_error_px": null, "ridge": [[-18.5, 0.0, 0.2], [18.5, 0.0, 0.2]], "cameras": [{"id": "left", "image_size": [64, 48], "intrinsics": {"model": "opencv", "matrix": [[60.0, 0.0, 32.0], [0.0, 60.0, 24.0], [0.0, 0.0, 1.0]], "distortion": [], "sigma": null}, "pose": {"rotation": [1.6, 0.1, -0.2], "position": [-1.0, -50.0, 8.0], "translation": [10.895927751576597, 5.882718243455158, 49.10878113434035]}}, {"id": "right", "image_size": [64, 48], "intrinsics": {"model": "opencv", "matrix": [[60.0, 0.0, 32.0], [0.0, 60.0, 24.0], [0.0, 0.0, 1.0]], "distortion": [], "sigma": {"fx": 0.5}}, "pose": {"rotation": [1.6, 0.1, -0.2], "position": [-1.0, -50.0, 8.0], "translation": [10.895927751576597, 5.882718243455158, 49.10878113434035]}}], "changed": ["left", "right"]}', NULL);
INSERT INTO public.events VALUES (10, 'rejected', 'venue.created', '2026-11-23 17:55:36.485834+00', '{"venue": "rejected", "changed": []}', NULL);
INSERT INTO public.events VALUES (11, 'rejected', 'poses.changed', '2026-11-23 17:55:36.487266+00', '{"venue": "rejected", "revision": 1, "cause": "put", "job": null, "stitch_error_px": null, "ridge": null, "cameras": [{"id": "left", "image_size": [64, 48], "intrinsics": {"model": "opencv", "matrix": [[60.0, 0.0, 32.0], [0.0, 60.0, 24.0], [0.0, 0.0, 1.0]], "distortion": [], "sigma": null}, "pose": {"rotation": [1.6, 0.1, -0.2], "position": [-1.0, -50.0, 8.0], "translation": [10.895927751576597, 5.882718243455158, 49.10878113434035]}}, {"id": "right", "image_size": [64, 48], "intrinsics": {"model": "opencv", "matrix": [[60.0, 0.0, 32.0], [0.0, 60.0, 24.0], [0.0, 0.0, 1.0]], "distortion": [], "sigma": null}, "pose": {"rotation": [1.6, 0.1, -0.2], "position": [-1.0, -50.0, 8.0], "translation": [10.895927751576597, 5.882718243455158, 49.10878113434035]}}], "changed": ["left", "right"]}', NULL);
INSERT INTO public.events VALUES (12, 'rejected', 'job.queued', '2026-11-23 17:55:36.586496+00', NULL, '01M84RS3YNF3BKJPCAW6PN8RMJ');
INSERT INTO public.events VALUES (13, 'rejected', 'job.succeeded', '2026-11-23 17:55:37.258657+00', NULL, '01M84RS3YNF3BKJPCAW6PN8RMJ');
INSERT INTO public.events VALUES (14, 'partly', 'venue.created', '2026-11-23 17:55:37.467363+00', '{"venue": "partly", "changed": []}', NULL);
INSERT INTO public.events VALUES (15, 'partly', 'poses.changed', '2026-11-23 17:55:37.468486+00', '{"venue": "partly", "revision": 1, "cause": "put", "job": null, "stitch_error_px": null, "ridge": null, "cameras": [{"id": "left", "image_size": [64, 48], "intrinsics": {"model": "opencv", "matrix": [[60.0, 0.0, 32.0], [0.0, 60.0, 24.0], [0.0, 0.0, 1.0]], "distortion": [], "sigma": null}, "pose": {"rotation": [1.6, 0.1, -0.2], "position": [-1.0, -50.0, 8.0], "translation": [10.895927751576597, 5.882718243455158, 49.10878113434035]}}, {"id": "right", "image_size": [64, 48], "intrinsics": {"model": "opencv", "matrix": [[60.0, 0.0, 32.0], [0.0, 60.0, 24.0], [0.0, 0.0, 1.0]], "distortion": [], "sigma": null}, "pose": {"rotation": [1.6, 0.1, -0.2], "position": [-1.0, -50.0, 8.0], "translation": [10.895927751576597, 5.882718243455158, 49.10878113434035]}}], "changed": ["left", "right"]}', NULL);
INSERT INTO public.events VALUES (16, 'partly', 'job.queued', '2026-11-23 17:55:37.590429+00', NULL, '01M84RS4XSR2YR9TMF0R2EMGNZ');
INSERT INTO public.events VALUES (17, 'partly', 'job.succeeded', '2026-11-23 17:55:37.843229+00', NULL, '01M84RS4XSR2YR9TMF0R2EMGNZ');
INSERT INTO public.events VALUES (18, 'failed', 'venue.created', '2026-11-23 17:55:37.996025+00', '{"venue": "failed", "changed": []}', NULL);
INSERT INTO public.events VALUES (19, 'failed', 'poses.changed', '2026-11-23 17:55:38.000978+00', '{"venue": "failed", "revision": 1, "cause": "put", "job": null, "stitch_error_px": null, "ridge": null, "cameras": [{"id": "left", "image_size": [64, 48], "intrinsics": {"model": "opencv", "matrix": [[60.0, 0.0, 32.0], [0.0, 60.0, 24.0], [0.0, 0.0, 1.0]], "distortion": [], "sigma": null}, "pose": {"rotation": [1.6, 0.1, -0.2], "position": [-1.0, -50.0, 8.0], "translation": [10.895927751576597, 5.882718243455158, 49.10878113434035]}}, {"id": "right", "image_size": [64, 48], "intrinsics": {"model": "opencv", "matrix": [[60.0, 0.0, 32.0], [0.0, 60.0, 24.0], [0.0, 0.0, 1.0]], "distortion": [], "sigma": null}, "pose": {"rotation": [1.6, 0.1, -0.2], "position": [-1.0, -50.0, 8.0], "translation": [10.895927751576597, 5.882718243455158, 49.10878113434035]}}], "changed": ["left", "right"]}', NULL);
INSERT INTO public.events VALUES (20, 'failed', 'job.queued', '2026-11-23 17:55:38.093087+00', NULL, '01M84RS5ED8FSM9HGTGTVSEB2S');
INSERT INTO public.events VALUES (21, 'failed', 'job.failed', '2026-11-23 17:55:38.372129+00', NULL, '01M84RS5ED8FSM9HGTGTVSEB2S');
INSERT INTO public.events VALUES (22, 'rejected', 'job.queued', '2026-11-23 17:55:38.530205+00', NULL, '01M84RS5W911HX23VAFXWPKVRX');
INSERT INTO public.events VALUES (23, 'rejected', 'job.succeeded', '2026-11-23 17:55:38.992571+00', NULL, '01M84RS5W911HX23VAFXWPKVRX');
INSERT INTO public.events VALUES (24, 'rejected', 'job.queued', '2026-11-23 17:55:39.359231+00', NULL, '01M84RS6P8T5W240Q7J1G6MTMF');
INSERT INTO public.events VALUES (25, 'rejected', 'job.failed', '2026-11-23 17:55:39.962925+00', NULL, '01M84RS6P8T5W240Q7J1G6MTMF');
INSERT INTO public.events VALUES (26, 'waiting', 'venue.created', '2026-11-23 17:55:45.392196+00', '{"venue": "waiting", "changed": []}', NULL);
INSERT INTO public.events VALUES (27, 'waiting', 'poses.changed', '2026-11-23 17:55:45.400155+00', '{"venue": "waiting", "revision": 1, "cause": "put", "job": null, "stitch_error_px": null, "ridge": null, "cameras": [{"id": "left", "image_size": [64, 48], "intrinsics": {"model": "opencv", "matrix": [[60.0, 0.0, 32.0], [0.0, 60.0, 24.0], [0.0, 0.0, 1.0]], "distortion": [], "sigma": null}, "pose": {"rotation": [1.6, 0.1, -0.2], "position": [-1.0, -50.0, 8.0], "translation": [10.895927751576597, 5.882718243455158, 49.10878113434035]}}, {"id": "right", "image_size": [64, 48], "intrinsics": {"model": "opencv", "matrix": [[60.0, 0.0, 32.0], [0.0, 60.0, 24.0], [0.0, 0.0, 1.0]], "distortion": [], "sigma": null}, "pose": {"rotation": [1.6, 0.1, -0.2], "position": [-1.0, -50.0, 8.0], "translation": [10.895927751576597, 5.882718243455158, 49.10878113434035]}}], "changed": ["left", "right"]}', NULL);
INSERT INTO public.events VALUES (28, 'waiting', 'job.queued', '2026-11-23 17:55:45.815155+00', NULL, '01M84RSCZ092M08PMWN6QR64JA');
INSERT INTO public.events VALUES (29, 'cancelled', 'venue.created', '2026-11-23 17:55:45.996135+00', '{"venue": "cancelled", "changed": []}', NULL);
INSERT INTO public.events VALUES (30, 'cancelled', 'poses.changed', '2026-11-23 17:55:46.000746+00', '{"venue": "cancelled", "revision": 1, "cause": "put", "job": null, "stitch_error_px": null, "ridge": null, "cameras": [{"id": "left", "image_size": [64, 48], "intrinsics": {"model": "opencv", "matrix": [[60.0, 0.0, 32.0], [0.0, 60.0, 24.0], [0.0, 0.0, 1.0]], "distortion": [], "sigma": null}, "pose": {"rotation": [1.6, 0.1, -0.2], "position": [-1.0, -50.0, 8.0], "translation": [10.895927751576597, 5.882718243455158, 49.10878113434035]}}, {"id": "right", "image_size": [64, 48], "intrinsics": {"model": "opencv", "matrix": [[60.0, 0.0, 32.0], [0.0, 60.0, 24.0], [0.0, 0.0, 1.0]], "distortion": [], "sigma": null}, "pose": {"rotation": [1.6, 0.1, -0.2], "position": [-1.0, -50.0, 8.0], "translation": [10.895927751576597, 5.882718243455158, 49.10878113434035]}}], "changed": ["left", "right"]}', NULL);
INSERT INTO public.events VALUES (31, 'cancelled', 'job.queued', '2026-11-23 17:55:46.094045+00', NULL, '01M84RSD7TTEJQDYVTH3SGTWP2');
INSERT INTO public.events VALUES (32, 'cancelled', 'job.cancelled', '2026-11-23 17:55:46.14577+00', NULL, '01M84RSD7TTEJQDYVTH3SGTWP2');
INSERT INTO public.jobs VALUES ('01M84RS2B0CCB0SCJXVSENDJV7', 'calibration', 'everything', 'succeeded', 100, '{"priority": "routine", "timeout_s": null, "callback_url": "https://example.com/end", "preset": "esc", "search": "auto", "seed": 1213333477, "generations": 100, "parents": 64, "offspring": 128, "stitch_weight": 0.5, "flat": false, "fit_focal_length": false, "fit_ridge": false, "dry_run": false, "pictures": false}', 'eafed287b216c15889fc967c7a1cbe23049be978c695b93e2c10844ef38ad42a', 'first', '{"id": "everything", "name": "accept", "field": {"template": "football", "length_m": 105.0, "width_m": 68.0, "line_width_m": 0.12, "measures_m": {}, "ridge": [[-18.5, 0.0, 0.2], [18.5, 0.0, 0.2]], "other_markings": []}, "cameras": [{"id": "left", "image_size": [64, 48], "intrinsics": {"model": "opencv", "matrix": [[60.0, 0.0, 32.0], [0.0, 60.0, 24.0], [0.0, 0.0, 1.0]], "distortion": [], "sigma": null}, "pose": {"rotation": [1.6, 0.1, -0.2], "position": [-1.0, -50.0, 8.0], "translation": [10.895927751576597, 5.882718243455158, 49.10878113434035]}, "ignore": [[[0.0, 40.0], [20.0, 40.0], [20.0, 47.0]]], "source": "http://***@example.com/a.jpg"}, {"id": "right", "image_size": [64, 48], "intrinsics": {"model": "opencv", "matrix": [[60.0, 0.0, 32.0], [0.0, 60.0, 24.0], [0.0, 0.0, 1.0]], "distortion": [], "sigma": {"fx": 0.5}}, "pose": {"rotation": [1.6, 0.1, -0.2], "position": [-1.0, -50.0, 8.0], "translation": [10.895927751576597, 5.882718243455158, 49.10878113434035]}, "ignore": [], "source": "http://example.com/b.jpg"}], "accept": "all", "lens": "may-drift", "alarms": {"moved_since_last_px": null, "moved_since_first_px": 40.0, "rejected_in_a_row": 1, "not_calibrated_for_h": null, "callback_url": "https://example.com/alarms"}, "schedule": {"cron": "0 3 1 1 *", "time_zone": "Europe/Berlin", "exact": false, "options": {"priority": "routine", "timeout_s": null, "callback_url": null, "preset": "esc", "search": "auto", "seed": 3, "generations": 100, "parents": 64, "offspring": 128, "stitch_weight": 0.5, "flat": false, "fit_focal_length": false, "fit_ridge": false, "dry_run": false, "pictures": false}}, "webhooks": [{"url": "https://example.com/told", "events": ["poses.changed", "venue.*"]}]}', '{"left": ["frames/01M84RS2B0CCB0SCJXVSENDJV7/left/0"], "right": ["frames/01M84RS2B0CCB0SCJXVSENDJV7/right/0"]}', 1, 'a314047a1c604130ac42734396aaed96', 4, '{"stage": "preview", "fraction": 1.0, "generation": null, "loss": null}', '{"verdict": "accepted", "accepted": true, "rejected_because": null, "cameras": [{"id": "left", "accepted": true, "rejected_because": null, "refusal": null, "pose": {"rotation": [1.6, 0.1, -0.2], "position": [-0.875, -43.75, 7.0], "translation": [9.533936782629523, 5.147378463023263, 42.970183492547804]}, "intrinsics": null, "sigma": null, "repeatability": null, "moved": {"rotation_deg": 0.0, "position_m": 6.4, "pixels": 1.0}, "iou": 0.9, "expected_found": null, "unexpected": null, "found": null, "by_chance": null, "residual_px": 1.0, "view": null, "markings": []}, {"id": "right", "accepted": true, "rejected_because": null, "refusal": null, "pose": {"rotation": [1.6, 0.1, -0.2], "position": [-0.875, -43.75, 7.0], "translation": [9.533936782629523, 5.147378463023263, 42.970183492547804]}, "intrinsics": null, "sigma": null, "repeatability": null, "moved": {"rotation_deg": 0.0, "position_m": 6.4, "pixels": 1.0}, "iou": 0.9, "expected_found": null, "unexpected": null, "found": null, "by_chance": null, "residual_px": 1.0, "view": null, "markings": []}], "ridge": null, "diagnosis": [], "stitch_error_px": 0.2, "stitch_error_before_px": 10.0, "stitch_error_limit_px": null, "pairs": [], "loss": 0.1, "generations": 10, "path": "wide", "timings_s": {"decode": 0.1}, "cpu_s": {}, "provenance": {"software": "0", "model_sha256": "0", "seed": 1213333477, "options": {"priority": "routine", "timeout_s": null, "callback_url": null, "preset": "esc", "search": "auto", "seed": 1213333477, "generations": 100, "parents": 64, "offspring": 128, "stitch_weight": 0.5, "flat": false, "fit_focal_length": false, "fit_ridge": false, "dry_run": false, "pictures": false}}}', '["preview", "birdseye", "overlay_left", "overlay_right"]', NULL, '2026-11-23 17:55:34.913279+00', '2026-11-23 17:55:35.048483+00', '2026-11-23 17:55:35.684409+00', '2026-11-23 17:55:35.684409+00', NULL, NULL, NULL, 'efb84ebef1fe4453aa2482cf8544bf71', NULL);
INSERT INTO public.jobs VALUES ('01M84RS391K40T1NEXPF9TAVSC', 'calibration', 'everything', 'succeeded', 100, '{"priority": "routine", "timeout_s": null, "callback_url": null, "preset": "esc", "search": "auto", "seed": 297788098, "generations": 100, "parents": 64, "offspring": 128, "stitch_weight": 0.5, "flat": true, "fit_focal_length": false, "fit_ridge": false, "dry_run": false, "pictures": false}', 'dfdcb0ca6abb47178127ebe2f08441dd7fc4a3c46b6f568e66a3e497c0cea502', NULL, '{"id": "everything", "name": "accept", "field": {"template": "football", "length_m": 105.0, "width_m": 68.0, "line_width_m": 0.12, "measures_m": {}, "ridge": [[-18.5, 0.0, 0.2], [18.5, 0.0, 0.2]], "other_markings": []}, "cameras": [{"id": "left", "image_size": [64, 48], "intrinsics": {"model": "opencv", "matrix": [[60.0, 0.0, 32.0], [0.0, 60.0, 24.0], [0.0, 0.0, 1.0]], "distortion": [], "sigma": null}, "pose": {"rotation": [1.6, 0.1, -0.2], "position": [-0.875, -43.75, 7.0], "translation": [9.533936782629523, 5.147378463023263, 42.970183492547804]}, "ignore": [[[0.0, 40.0], [20.0, 40.0], [20.0, 47.0]]], "source": "http://***@example.com/a.jpg"}, {"id": "right", "image_size": [64, 48], "intrinsics": {"model": "opencv", "matrix": [[60.0, 0.0, 32.0], [0.0, 60.0, 24.0], [0.0, 0.0, 1.0]], "distortion": [], "sigma": {"fx": 0.5}}, "pose": {"rotation": [1.6, 0.1, -0.2], "position": [-0.875, -43.75, 7.0], "translation": [9.533936782629523, 5.147378463023263, 42.970183492547804]}, "ignore": [], "source": "http://example.com/b.jpg"}], "accept": "all", "lens": "may-drift", "alarms": {"moved_since_last_px": null, "moved_since_first_px": 40.0, "rejected_in_a_row": 1, "not_calibrated_for_h": null, "callback_url": "https://example.com/alarms"}, "schedule": {"cron": "0 3 1 1 *", "time_zone": "Europe/Berlin", "exact": false, "options": {"priority": "routine", "timeout_s": null, "callback_url": null, "preset": "esc", "search": "auto", "seed": 3, "generations": 100, "parents": 64, "offspring": 128, "stitch_weight": 0.5, "flat": false, "fit_focal_length": false, "fit_ridge": false, "dry_run": false, "pictures": false}}, "webhooks": [{"url": "https://example.com/told", "events": ["poses.changed", "venue.*"]}]}', '{"left": ["frames/01M84RS391K40T1NEXPF9TAVSC/left/0"], "right": ["frames/01M84RS391K40T1NEXPF9TAVSC/right/0"]}', 1, '4c8e16e2d51f49d6b86cea0fc686599a', 4, '{"stage": "preview", "fraction": 1.0, "generation": null, "loss": null}', '{"verdict": "accepted", "accepted": true, "rejected_because": null, "cameras": [{"id": "left", "accepted": true, "rejected_because": null, "refusal": null, "pose": {"rotation": [1.6, 0.1, -0.2], "position": [-0.765625, -38.28125, 6.125], "translation": [8.342194684800832, 4.503956155145355, 37.59891055597933]}, "intrinsics": null, "sigma": null, "repeatability": null, "moved": {"rotation_deg": 0.0, "position_m": 6.4, "pixels": 1.0}, "iou": 0.9, "expected_found": null, "unexpected": null, "found": null, "by_chance": null, "residual_px": 1.0, "view": null, "markings": []}, {"id": "right", "accepted": true, "rejected_because": null, "refusal": null, "pose": {"rotation": [1.6, 0.1, -0.2], "position": [-0.765625, -38.28125, 6.125], "translation": [8.342194684800832, 4.503956155145355, 37.59891055597933]}, "intrinsics": null, "sigma": null, "repeatability": null, "moved": {"rotation_deg": 0.0, "position_m": 6.4, "pixels": 1.0}, "iou": 0.9, "expected_found": null, "unexpected": null, "found": null, "by_chance": null, "residual_px": 1.0, "view": null, "markings": []}], "ridge": null, "diagnosis": [], "stitch_error_px": 0.2, "stitch_error_before_px": 10.0, "stitch_error_limit_px": null, "pairs": [], "loss": 0.1, "generations": 10, "path": "wide", "timings_s": {"decode": 0.1}, "cpu_s": {}, "provenance": {"software": "0", "model_sha256": "0", "seed": 297788098, "options": {"priority": "routine", "timeout_s": null, "callback_url": null, "preset": "esc", "search": "auto", "seed": 297788098, "generations": 100, "parents": 64, "offspring": 128, "stitch_weight": 0.5, "flat": true, "fit_focal_length": false, "fit_ridge": false, "dry_run": false, "pictures": false}}}', '["preview", "birdseye", "overlay_left", "overlay_right"]', NULL, '2026-11-23 17:55:35.892155+00', '2026-11-23 17:55:36.080421+00', '2026-11-23 17:55:36.304638+00', '2026-11-23 17:55:36.304638+00', NULL, NULL, NULL, '2a7f3a9cd128428da60cfe6da8ad49ed', NULL);
INSERT INTO public.jobs VALUES ('01M84RS5W911HX23VAFXWPKVRX', 'field', 'rejected', 'succeeded', 100, '{"priority": "routine", "timeout_s": null, "callback_url": null, "seed": 1152229169}', '6f8bf866d481fd5c00a602017513785d63eee08a51e5096e6dd43c9cb1427ee2', NULL, '{"id": "rejected", "name": "reject", "field": {"template": "football", "length_m": 105.0, "width_m": 68.0, "line_width_m": 0.12, "measures_m": {}, "ridge": null, "other_markings": []}, "cameras": [{"id": "left", "image_size": [64, 48], "intrinsics": {"model": "opencv", "matrix": [[60.0, 0.0, 32.0], [0.0, 60.0, 24.0], [0.0, 0.0, 1.0]], "distortion": [], "sigma": null}, "pose": {"rotation": [1.6, 0.1, -0.2], "position": [-1.0, -50.0, 8.0], "translation": [10.895927751576597, 5.882718243455158, 49.10878113434035]}, "ignore": [], "source": null}, {"id": "right", "image_size": [64, 48], "intrinsics": {"model": "opencv", "matrix": [[60.0, 0.0, 32.0], [0.0, 60.0, 24.0], [0.0, 0.0, 1.0]], "distortion": [], "sigma": null}, "pose": {"rotation": [1.6, 0.1, -0.2], "position": [-1.0, -50.0, 8.0], "translation": [10.895927751576597, 5.882718243455158, 49.10878113434035]}, "ignore": [], "source": null}], "accept": "each", "lens": "fixed", "alarms": null, "schedule": null, "webhooks": []}', '{"left": ["frames/01M84RS5W911HX23VAFXWPKVRX/left/0"], "right": ["frames/01M84RS5W911HX23VAFXWPKVRX/right/0"]}', 1, 'e7feb6a73a0948ce967244a0bd98d876', 4, '{"stage": "preview", "fraction": 1.0, "generation": null, "loss": null}', '{"accepted": false, "rejected_because": "the lines do not fit", "field": {"template": "football", "length_m": 104.25, "width_m": 68.0, "line_width_m": 0.12, "measures_m": {}, "ridge": null, "other_markings": []}, "measures": [{"name": "length_m", "given": 105.0, "value": 104.25, "sigma": 0.05, "open": 5.0, "known": true, "detail": ""}, {"name": "width_m", "given": 68.0, "value": 67.0, "sigma": 5.0, "open": 5.0, "known": false, "detail": "no line seen"}], "cameras": [{"id": "left", "accepted": false, "rejected_because": "the lines do not fit", "refusal": null, "pose": {"rotation": [1.6, 0.1, -0.2], "position": [-0.875, -43.75, 7.0], "translation": [9.533936782629523, 5.147378463023263, 42.970183492547804]}, "intrinsics": null, "sigma": null, "repeatability": null, "moved": {"rotation_deg": 0.0, "position_m": 6.4, "pixels": 1.0}, "iou": 0.9, "expected_found": null, "unexpected": null, "found": null, "by_chance": null, "residual_px": 1.0, "view": null, "markings": []}, {"id": "right", "accepted": false, "rejected_because": "the lines do not fit", "refusal": null, "pose": {"rotation": [1.6, 0.1, -0.2], "position": [-0.875, -43.75, 7.0], "translation": [9.533936782629523, 5.147378463023263, 42.970183492547804]}, "intrinsics": null, "sigma": null, "repeatability": null, "moved": {"rotation_deg": 0.0, "position_m": 6.4, "pixels": 1.0}, "iou": 0.9, "expected_found": null, "unexpected": null, "found": null, "by_chance": null, "residual_px": 1.0, "view": null, "markings": []}], "stitch_error_px": 0.2, "timings_s": {"decode": 0.1}, "cpu_s": {}, "provenance": {"software": "0", "model_sha256": "0", "seed": 1152229169, "options": {"priority": "routine", "timeout_s": null, "callback_url": null, "seed": 1152229169}}}', '["overlay_right"]', NULL, '2026-11-23 17:55:38.530205+00', '2026-11-23 17:55:38.76272+00', '2026-11-23 17:55:38.992571+00', '2026-11-23 17:55:38.992571+00', NULL, NULL, NULL, '5a8b6ecc6d8a47a8baca81d91322a6bc', NULL);
INSERT INTO public.jobs VALUES ('01M84RS3YNF3BKJPCAW6PN8RMJ', 'calibration', 'rejected', 'succeeded', 100, '{"priority": "routine", "timeout_s": null, "callback_url": null, "preset": "esc", "search": "auto", "seed": 2115618880, "generations": 100, "parents": 64, "offspring": 128, "stitch_weight": 0.5, "flat": false, "fit_focal_length": false, "fit_ridge": false, "dry_run": false, "pictures": false}', '166038974189b3168e8b65814acd6a80f17651bf65e8b2a4a5218378ef574326', NULL, '{"id": "rejected", "name": "reject", "field": {"template": "football", "length_m": 105.0, "width_m": 68.0, "line_width_m": 0.12, "measures_m": {}, "ridge": null, "other_markings": []}, "cameras": [{"id": "left", "image_size": [64, 48], "intrinsics": {"model": "opencv", "matrix": [[60.0, 0.0, 32.0], [0.0, 60.0, 24.0], [0.0, 0.0, 1.0]], "distortion": [], "sigma": null}, "pose": {"rotation": [1.6, 0.1, -0.2], "position": [-1.0, -50.0, 8.0], "translation": [10.895927751576597, 5.882718243455158, 49.10878113434035]}, "ignore": [], "source": null}, {"id": "right", "image_size": [64, 48], "intrinsics": {"model": "opencv", "matrix": [[60.0, 0.0, 32.0], [0.0, 60.0, 24.0], [0.0, 0.0, 1.0]], "distortion": [], "sigma": null}, "pose": {"rotation": [1.6, 0.1, -0.2], "position": [-1.0, -50.0, 8.0], "translation": [10.895927751576597, 5.882718243455158, 49.10878113434035]}, "ignore": [], "source": null}], "accept": "each", "lens": "fixed", "alarms": null, "schedule": null, "webhooks": []}', '{"left": ["frames/01M84RS3YNF3BKJPCAW6PN8RMJ/left/0"], "right": ["frames/01M84RS3YNF3BKJPCAW6PN8RMJ/right/0"]}', 1, '290686ee62dd49b181aec42fbfa0eebc', 4, '{"stage": "preview", "fraction": 1.0, "generation": null, "loss": null}', '{"verdict": "rejected", "accepted": false, "rejected_because": "the lines do not fit", "cameras": [{"id": "left", "accepted": false, "rejected_because": "the lines do not fit", "refusal": null, "pose": {"rotation": [1.6, 0.1, -0.2], "position": [-0.875, -43.75, 7.0], "translation": [9.533936782629523, 5.147378463023263, 42.970183492547804]}, "intrinsics": null, "sigma": null, "repeatability": null, "moved": {"rotation_deg": 0.0, "position_m": 6.4, "pixels": 1.0}, "iou": 0.9, "expected_found": null, "unexpected": null, "found": null, "by_chance": null, "residual_px": 1.0, "view": null, "markings": []}, {"id": "right", "accepted": false, "rejected_because": "the lines do not fit", "refusal": null, "pose": {"rotation": [1.6, 0.1, -0.2], "position": [-0.875, -43.75, 7.0], "translation": [9.533936782629523, 5.147378463023263, 42.970183492547804]}, "intrinsics": null, "sigma": null, "repeatability": null, "moved": {"rotation_deg": 0.0, "position_m": 6.4, "pixels": 1.0}, "iou": 0.9, "expected_found": null, "unexpected": null, "found": null, "by_chance": null, "residual_px": 1.0, "view": null, "markings": []}], "ridge": null, "diagnosis": [], "stitch_error_px": 0.2, "stitch_error_before_px": 10.0, "stitch_error_limit_px": null, "pairs": [], "loss": 0.1, "generations": 10, "path": "wide", "timings_s": {"decode": 0.1}, "cpu_s": {}, "provenance": {"software": "0", "model_sha256": "0", "seed": 2115618880, "options": {"priority": "routine", "timeout_s": null, "callback_url": null, "preset": "esc", "search": "auto", "seed": 2115618880, "generations": 100, "parents": 64, "offspring": 128, "stitch_weight": 0.5, "flat": false, "fit_focal_length": false, "fit_ridge": false, "dry_run": false, "pictures": false}}}', '["birdseye", "overlay_left", "overlay_right"]', NULL, '2026-11-23 17:55:36.586496+00', '2026-11-23 17:55:37.103208+00', '2026-11-23 17:55:37.258657+00', '2026-11-23 17:55:37.258657+00', NULL, NULL, NULL, '6d7a68e6c6b448488e9dcd5acd933e09', NULL);
INSERT INTO public.jobs VALUES ('01M84RS4XSR2YR9TMF0R2EMGNZ', 'calibration', 'partly', 'succeeded', 100, '{"priority": "routine", "timeout_s": null, "callback_url": null, "preset": "esc", "search": "auto", "seed": 794777290, "generations": 100, "parents": 64, "offspring": 128, "stitch_weight": 0.5, "flat": false, "fit_focal_length": false, "fit_ridge": false, "dry_run": true, "pictures": false}', '72931535960c38863760dc0e9ff187aa99d3d4304bc2a5ba4ea5fa11848e27e9', NULL, '{"id": "partly", "name": "partly", "field": {"template": "football", "length_m": 105.0, "width_m": 68.0, "line_width_m": 0.12, "measures_m": {}, "ridge": null, "other_markings": []}, "cameras": [{"id": "left", "image_size": [64, 48], "intrinsics": {"model": "opencv", "matrix": [[60.0, 0.0, 32.0], [0.0, 60.0, 24.0], [0.0, 0.0, 1.0]], "distortion": [], "sigma": null}, "pose": {"rotation": [1.6, 0.1, -0.2], "position": [-1.0, -50.0, 8.0], "translation": [10.895927751576597, 5.882718243455158, 49.10878113434035]}, "ignore": [], "source": null}, {"id": "right", "image_size": [64, 48], "intrinsics": {"model": "opencv", "matrix": [[60.0, 0.0, 32.0], [0.0, 60.0, 24.0], [0.0, 0.0, 1.0]], "distortion": [], "sigma": null}, "pose": {"rotation": [1.6, 0.1, -0.2], "position": [-1.0, -50.0, 8.0], "translation": [10.895927751576597, 5.882718243455158, 49.10878113434035]}, "ignore": [], "source": null}], "accept": "each", "lens": "fixed", "alarms": null, "schedule": null, "webhooks": []}', '{"left": ["frames/01M84RS4XSR2YR9TMF0R2EMGNZ/left/0"], "right": ["frames/01M84RS4XSR2YR9TMF0R2EMGNZ/right/0"]}', 1, '6122d567856545258e2c110fab8abb49', 4, '{"stage": "preview", "fraction": 1.0, "generation": null, "loss": null}', '{"verdict": "partly", "accepted": false, "rejected_because": "the lines do not fit", "cameras": [{"id": "left", "accepted": true, "rejected_because": null, "refusal": null, "pose": {"rotation": [1.6, 0.1, -0.2], "position": [-0.875, -43.75, 7.0], "translation": [9.533936782629523, 5.147378463023263, 42.970183492547804]}, "intrinsics": null, "sigma": null, "repeatability": null, "moved": {"rotation_deg": 0.0, "position_m": 6.4, "pixels": 1.0}, "iou": 0.9, "expected_found": null, "unexpected": null, "found": null, "by_chance": null, "residual_px": 1.0, "view": null, "markings": []}, {"id": "right", "accepted": false, "rejected_because": "the lines do not fit", "refusal": null, "pose": {"rotation": [1.6, 0.1, -0.2], "position": [-0.875, -43.75, 7.0], "translation": [9.533936782629523, 5.147378463023263, 42.970183492547804]}, "intrinsics": null, "sigma": null, "repeatability": null, "moved": {"rotation_deg": 0.0, "position_m": 6.4, "pixels": 1.0}, "iou": 0.9, "expected_found": null, "unexpected": null, "found": null, "by_chance": null, "residual_px": 1.0, "view": null, "markings": []}], "ridge": null, "diagnosis": [], "stitch_error_px": 0.2, "stitch_error_before_px": 10.0, "stitch_error_limit_px": null, "pairs": [], "loss": 0.1, "generations": 10, "path": "wide", "timings_s": {"decode": 0.1}, "cpu_s": {}, "provenance": {"software": "0", "model_sha256": "0", "seed": 794777290, "options": {"priority": "routine", "timeout_s": null, "callback_url": null, "preset": "esc", "search": "auto", "seed": 794777290, "generations": 100, "parents": 64, "offspring": 128, "stitch_weight": 0.5, "flat": false, "fit_focal_length": false, "fit_ridge": false, "dry_run": true, "pictures": false}}}', '["preview", "birdseye", "overlay_left", "overlay_right"]', NULL, '2026-11-23 17:55:37.590429+00', '2026-11-23 17:55:37.667435+00', '2026-11-23 17:55:37.843229+00', '2026-11-23 17:55:37.843229+00', NULL, NULL, NULL, '6712d987c5cb490a9e891b4a73d2bb5f', NULL);
INSERT INTO public.jobs VALUES ('01M84RS5ED8FSM9HGTGTVSEB2S', 'calibration', 'failed', 'failed', 100, '{"priority": "routine", "timeout_s": null, "callback_url": null, "preset": "esc", "search": "auto", "seed": 1152620854, "generations": 100, "parents": 64, "offspring": 128, "stitch_weight": 0.5, "flat": false, "fit_focal_length": false, "fit_ridge": false, "dry_run": false, "pictures": false}', '166038974189b3168e8b65814acd6a80f17651bf65e8b2a4a5218378ef574326', NULL, '{"id": "failed", "name": "fail", "field": {"template": "football", "length_m": 105.0, "width_m": 68.0, "line_width_m": 0.12, "measures_m": {}, "ridge": null, "other_markings": []}, "cameras": [{"id": "left", "image_size": [64, 48], "intrinsics": {"model": "opencv", "matrix": [[60.0, 0.0, 32.0], [0.0, 60.0, 24.0], [0.0, 0.0, 1.0]], "distortion": [], "sigma": null}, "pose": {"rotation": [1.6, 0.1, -0.2], "position": [-1.0, -50.0, 8.0], "translation": [10.895927751576597, 5.882718243455158, 49.10878113434035]}, "ignore": [], "source": null}, {"id": "right", "image_size": [64, 48], "intrinsics": {"model": "opencv", "matrix": [[60.0, 0.0, 32.0], [0.0, 60.0, 24.0], [0.0, 0.0, 1.0]], "distortion": [], "sigma": null}, "pose": {"rotation": [1.6, 0.1, -0.2], "position": [-1.0, -50.0, 8.0], "translation": [10.895927751576597, 5.882718243455158, 49.10878113434035]}, "ignore": [], "source": null}], "accept": "each", "lens": "fixed", "alarms": null, "schedule": null, "webhooks": []}', '{"left": ["frames/01M84RS5ED8FSM9HGTGTVSEB2S/left/0"], "right": ["frames/01M84RS5ED8FSM9HGTGTVSEB2S/right/0"]}', 1, '2789e34646be4dc8b87d6cd9b7014bd5', 4, '{"stage": "segmentation", "fraction": 0.1, "generation": null, "loss": null}', NULL, NULL, '{"type": "/problems/no-markings-in-view", "title": "", "detail": "It is black.", "camera": "left"}', '2026-11-23 17:55:38.093087+00', '2026-11-23 17:55:38.209888+00', '2026-11-23 17:55:38.372129+00', '2026-11-23 17:55:38.372129+00', NULL, NULL, NULL, '0b30b067049542768763f61b8b660b5d', NULL);
INSERT INTO public.jobs VALUES ('01M84RS6P8T5W240Q7J1G6MTMF', 'locate', 'rejected', 'failed', 100, '{"priority": "routine", "timeout_s": null, "callback_url": null, "points": [{"world": [0.0, 0.0], "pixel": [5.0, 5.0]}, {"world": [0.0, 1.0], "pixel": [5.0, 15.0]}, {"world": [1.0, 0.0], "pixel": [15.0, 5.0]}, {"world": [1.0, 1.0], "pixel": [15.0, 15.0]}]}', '37d329fd1d09cf2464de1c1cce636e901ba74c23700bf257d6268bbbe60cad1f', NULL, '{"id": "rejected", "name": "reject", "field": {"template": "football", "length_m": 105.0, "width_m": 68.0, "line_width_m": 0.12, "measures_m": {}, "ridge": null, "other_markings": []}, "cameras": [{"id": "left", "image_size": [64, 48], "intrinsics": {"model": "opencv", "matrix": [[60.0, 0.0, 32.0], [0.0, 60.0, 24.0], [0.0, 0.0, 1.0]], "distortion": [], "sigma": null}, "pose": {"rotation": [1.6, 0.1, -0.2], "position": [-1.0, -50.0, 8.0], "translation": [10.895927751576597, 5.882718243455158, 49.10878113434035]}, "ignore": [], "source": null}, {"id": "right", "image_size": [64, 48], "intrinsics": {"model": "opencv", "matrix": [[60.0, 0.0, 32.0], [0.0, 60.0, 24.0], [0.0, 0.0, 1.0]], "distortion": [], "sigma": null}, "pose": {"rotation": [1.6, 0.1, -0.2], "position": [-1.0, -50.0, 8.0], "translation": [10.895927751576597, 5.882718243455158, 49.10878113434035]}, "ignore": [], "source": null}], "accept": "each", "lens": "fixed", "alarms": null, "schedule": null, "webhooks": []}', '{"left": []}', 1, '77db13cc4f1449509e2e18b009081e71', 4, '{"stage": "segmentation", "fraction": 0.1, "generation": null, "loss": null}', NULL, NULL, '{"type": "/problems/no-pose", "title": "", "detail": "This program only moves cameras.", "camera": null}', '2026-11-23 17:55:39.359231+00', '2026-11-23 17:55:39.797667+00', '2026-11-23 17:55:39.962925+00', '2026-11-23 17:55:39.962925+00', NULL, NULL, NULL, '53fc281fdd03430da2f514980719c5a2', NULL);
INSERT INTO public.jobs VALUES ('01M84RSCZ092M08PMWN6QR64JA', 'calibration', 'waiting', 'queued', 100, '{"priority": "routine", "timeout_s": null, "callback_url": null, "preset": "esc", "search": "auto", "seed": 263817453, "generations": 100, "parents": 64, "offspring": 128, "stitch_weight": 0.5, "flat": false, "fit_focal_length": false, "fit_ridge": false, "dry_run": false, "pictures": false}', '166038974189b3168e8b65814acd6a80f17651bf65e8b2a4a5218378ef574326', 'waits', '{"id": "waiting", "name": "accept", "field": {"template": "football", "length_m": 105.0, "width_m": 68.0, "line_width_m": 0.12, "measures_m": {}, "ridge": null, "other_markings": []}, "cameras": [{"id": "left", "image_size": [64, 48], "intrinsics": {"model": "opencv", "matrix": [[60.0, 0.0, 32.0], [0.0, 60.0, 24.0], [0.0, 0.0, 1.0]], "distortion": [], "sigma": null}, "pose": {"rotation": [1.6, 0.1, -0.2], "position": [-1.0, -50.0, 8.0], "translation": [10.895927751576597, 5.882718243455158, 49.10878113434035]}, "ignore": [], "source": null}, {"id": "right", "image_size": [64, 48], "intrinsics": {"model": "opencv", "matrix": [[60.0, 0.0, 32.0], [0.0, 60.0, 24.0], [0.0, 0.0, 1.0]], "distortion": [], "sigma": null}, "pose": {"rotation": [1.6, 0.1, -0.2], "position": [-1.0, -50.0, 8.0], "translation": [10.895927751576597, 5.882718243455158, 49.10878113434035]}, "ignore": [], "source": null}], "accept": "each", "lens": "fixed", "alarms": null, "schedule": null, "webhooks": []}', '{"left": ["frames/01M84RSCZ092M08PMWN6QR64JA/left/0"], "right": ["frames/01M84RSCZ092M08PMWN6QR64JA/right/0"]}', 0, NULL, 1, NULL, NULL, NULL, NULL, '2026-11-23 17:55:45.815155+00', NULL, NULL, '2026-11-23 17:55:45.815155+00', NULL, NULL, NULL, 'e4f8482e33a14083abdefdd3b3c09c6d', NULL);
INSERT INTO public.jobs VALUES ('01M84RSD7TTEJQDYVTH3SGTWP2', 'calibration', 'cancelled', 'cancelled', 100, '{"priority": "routine", "timeout_s": null, "callback_url": null, "preset": "esc", "search": "auto", "seed": 1622093382, "generations": 100, "parents": 64, "offspring": 128, "stitch_weight": 0.5, "flat": false, "fit_focal_length": false, "fit_ridge": false, "dry_run": false, "pictures": false}', '166038974189b3168e8b65814acd6a80f17651bf65e8b2a4a5218378ef574326', NULL, '{"id": "cancelled", "name": "accept", "field": {"template": "football", "length_m": 105.0, "width_m": 68.0, "line_width_m": 0.12, "measures_m": {}, "ridge": null, "other_markings": []}, "cameras": [{"id": "left", "image_size": [64, 48], "intrinsics": {"model": "opencv", "matrix": [[60.0, 0.0, 32.0], [0.0, 60.0, 24.0], [0.0, 0.0, 1.0]], "distortion": [], "sigma": null}, "pose": {"rotation": [1.6, 0.1, -0.2], "position": [-1.0, -50.0, 8.0], "translation": [10.895927751576597, 5.882718243455158, 49.10878113434035]}, "ignore": [], "source": null}, {"id": "right", "image_size": [64, 48], "intrinsics": {"model": "opencv", "matrix": [[60.0, 0.0, 32.0], [0.0, 60.0, 24.0], [0.0, 0.0, 1.0]], "distortion": [], "sigma": null}, "pose": {"rotation": [1.6, 0.1, -0.2], "position": [-1.0, -50.0, 8.0], "translation": [10.895927751576597, 5.882718243455158, 49.10878113434035]}, "ignore": [], "source": null}], "accept": "each", "lens": "fixed", "alarms": null, "schedule": null, "webhooks": []}', '{"left": ["frames/01M84RSD7TTEJQDYVTH3SGTWP2/left/0"], "right": ["frames/01M84RSD7TTEJQDYVTH3SGTWP2/right/0"]}', 0, NULL, 2, NULL, NULL, NULL, NULL, '2026-11-23 17:55:46.094045+00', NULL, '2026-11-23 17:55:46.14577+00', '2026-11-23 17:55:46.14577+00', NULL, NULL, NULL, 'd269825ff8eb429489bb5bc02b7c964a', NULL);
INSERT INTO public.revisions VALUES (1, 'everything', 1, '2026-11-23 17:55:34.457164+00', 'put', NULL, NULL, NULL, '[{"id": "left", "image_size": [64, 48], "intrinsics": {"model": "opencv", "matrix": [[60.0, 0.0, 32.0], [0.0, 60.0, 24.0], [0.0, 0.0, 1.0]], "distortion": [], "sigma": null}, "pose": {"rotation": [1.6, 0.1, -0.2], "position": [-1.0, -50.0, 8.0], "translation": [10.895927751576597, 5.882718243455158, 49.10878113434035]}}, {"id": "right", "image_size": [64, 48], "intrinsics": {"model": "opencv", "matrix": [[60.0, 0.0, 32.0], [0.0, 60.0, 24.0], [0.0, 0.0, 1.0]], "distortion": [], "sigma": {"fx": 0.5}}, "pose": {"rotation": [1.6, 0.1, -0.2], "position": [-1.0, -50.0, 8.0], "translation": [10.895927751576597, 5.882718243455158, 49.10878113434035]}}]', '[[-18.5, 0.0, 0.2], [18.5, 0.0, 0.2]]', '{"left": {"moved": null, "drift": {"rotation_deg": 0.0, "position_m": 0.0, "pixels": 0.0}, "drift_since": 1}, "right": {"moved": null, "drift": {"rotation_deg": 0.0, "position_m": 0.0, "pixels": 0.0}, "drift_since": 1}}');
INSERT INTO public.revisions VALUES (2, 'everything', 2, '2026-11-23 17:55:35.408449+00', 'calibrated', '01M84RS2B0CCB0SCJXVSENDJV7', NULL, 0.2, '[{"id": "left", "image_size": [64, 48], "intrinsics": {"model": "opencv", "matrix": [[60.0, 0.0, 32.0], [0.0, 60.0, 24.0], [0.0, 0.0, 1.0]], "distortion": [], "sigma": null}, "pose": {"rotation": [1.6, 0.1, -0.2], "position": [-0.875, -43.75, 7.0], "translation": [9.533936782629523, 5.147378463023263, 42.970183492547804]}}, {"id": "right", "image_size": [64, 48], "intrinsics": {"model": "opencv", "matrix": [[60.0, 0.0, 32.0], [0.0, 60.0, 24.0], [0.0, 0.0, 1.0]], "distortion": [], "sigma": {"fx": 0.5}}, "pose": {"rotation": [1.6, 0.1, -0.2], "position": [-0.875, -43.75, 7.0], "translation": [9.533936782629523, 5.147378463023263, 42.970183492547804]}}]', '[[-18.5, 0.0, 0.2], [18.5, 0.0, 0.2]]', '{"left": {"moved": {"rotation_deg": 0.0, "position_m": 6.3307286310503, "pixels": 1.9838683658745555}, "drift": {"rotation_deg": 0.0, "position_m": 6.3307286310503, "pixels": 1.9838683658745555}, "drift_since": 1}, "right": {"moved": {"rotation_deg": 0.0, "position_m": 6.3307286310503, "pixels": 1.9838683658745555}, "drift": {"rotation_deg": 0.0, "position_m": 6.3307286310503, "pixels": 1.9838683658745555}, "drift_since": 1}}');
INSERT INTO public.revisions VALUES (3, 'everything', 3, '2026-11-23 17:55:36.294331+00', 'calibrated', '01M84RS391K40T1NEXPF9TAVSC', NULL, 0.2, '[{"id": "left", "image_size": [64, 48], "intrinsics": {"model": "opencv", "matrix": [[60.0, 0.0, 32.0], [0.0, 60.0, 24.0], [0.0, 0.0, 1.0]], "distortion": [], "sigma": null}, "pose": {"rotation": [1.6, 0.1, -0.2], "position": [-0.765625, -38.28125, 6.125], "translation": [8.342194684800832, 4.503956155145355, 37.59891055597933]}}, {"id": "right", "image_size": [64, 48], "intrinsics": {"model": "opencv", "matrix": [[60.0, 0.0, 32.0], [0.0, 60.0, 24.0], [0.0, 0.0, 1.0]], "distortion": [], "sigma": {"fx": 0.5}}, "pose": {"rotation": [1.6, 0.1, -0.2], "position": [-0.765625, -38.28125, 6.125], "translation": [8.342194684800832, 4.503956155145355, 37.59891055597933]}}]', '[[-18.5, 0.0, 0.2], [18.5, 0.0, 0.2]]', '{"left": {"moved": {"rotation_deg": 0.0, "position_m": 5.539387552169012, "pixels": 1.8055109552977942}, "drift": {"rotation_deg": 0.0, "position_m": 11.870116183219311, "pixels": 4.179859244701761}, "drift_since": 1}, "right": {"moved": {"rotation_deg": 0.0, "position_m": 5.539387552169012, "pixels": 1.8055109552977942}, "drift": {"rotation_deg": 0.0, "position_m": 11.870116183219311, "pixels": 4.179859244701761}, "drift_since": 1}}');
INSERT INTO public.revisions VALUES (4, 'everything', 4, '2026-11-23 17:55:36.392774+00', 'restored', NULL, 1, NULL, '[{"id": "left", "image_size": [64, 48], "intrinsics": {"model": "opencv", "matrix": [[60.0, 0.0, 32.0], [0.0, 60.0, 24.0], [0.0, 0.0, 1.0]], "distortion": [], "sigma": null}, "pose": {"rotation": [1.6, 0.1, -0.2], "position": [-1.0, -50.0, 8.0], "translation": [10.895927751576597, 5.882718243455158, 49.10878113434035]}}, {"id": "right", "image_size": [64, 48], "intrinsics": {"model": "opencv", "matrix": [[60.0, 0.0, 32.0], [0.0, 60.0, 24.0], [0.0, 0.0, 1.0]], "distortion": [], "sigma": {"fx": 0.5}}, "pose": {"rotation": [1.6, 0.1, -0.2], "position": [-1.0, -50.0, 8.0], "translation": [10.895927751576597, 5.882718243455158, 49.10878113434035]}}]', '[[-18.5, 0.0, 0.2], [18.5, 0.0, 0.2]]', '{"left": {"moved": {"rotation_deg": 0.0, "position_m": 11.870116183219311, "pixels": 2.899763883957856}, "drift": {"rotation_deg": 0.0, "position_m": 0.0, "pixels": 0.0}, "drift_since": 1}, "right": {"moved": {"rotation_deg": 0.0, "position_m": 11.870116183219311, "pixels": 2.899763883957856}, "drift": {"rotation_deg": 0.0, "position_m": 0.0, "pixels": 0.0}, "drift_since": 1}}');
INSERT INTO public.revisions VALUES (5, 'rejected', 1, '2026-11-23 17:55:36.487266+00', 'put', NULL, NULL, NULL, '[{"id": "left", "image_size": [64, 48], "intrinsics": {"model": "opencv", "matrix": [[60.0, 0.0, 32.0], [0.0, 60.0, 24.0], [0.0, 0.0, 1.0]], "distortion": [], "sigma": null}, "pose": {"rotation": [1.6, 0.1, -0.2], "position": [-1.0, -50.0, 8.0], "translation": [10.895927751576597, 5.882718243455158, 49.10878113434035]}}, {"id": "right", "image_size": [64, 48], "intrinsics": {"model": "opencv", "matrix": [[60.0, 0.0, 32.0], [0.0, 60.0, 24.0], [0.0, 0.0, 1.0]], "distortion": [], "sigma": null}, "pose": {"rotation": [1.6, 0.1, -0.2], "position": [-1.0, -50.0, 8.0], "translation": [10.895927751576597, 5.882718243455158, 49.10878113434035]}}]', 'null', '{"left": {"moved": null, "drift": {"rotation_deg": 0.0, "position_m": 0.0, "pixels": 0.0}, "drift_since": 1}, "right": {"moved": null, "drift": {"rotation_deg": 0.0, "position_m": 0.0, "pixels": 0.0}, "drift_since": 1}}');
INSERT INTO public.revisions VALUES (6, 'partly', 1, '2026-11-23 17:55:37.468486+00', 'put', NULL, NULL, NULL, '[{"id": "left", "image_size": [64, 48], "intrinsics": {"model": "opencv", "matrix": [[60.0, 0.0, 32.0], [0.0, 60.0, 24.0], [0.0, 0.0, 1.0]], "distortion": [], "sigma": null}, "pose": {"rotation": [1.6, 0.1, -0.2], "position": [-1.0, -50.0, 8.0], "translation": [10.895927751576597, 5.882718243455158, 49.10878113434035]}}, {"id": "right", "image_size": [64, 48], "intrinsics": {"model": "opencv", "matrix": [[60.0, 0.0, 32.0], [0.0, 60.0, 24.0], [0.0, 0.0, 1.0]], "distortion": [], "sigma": null}, "pose": {"rotation": [1.6, 0.1, -0.2], "position": [-1.0, -50.0, 8.0], "translation": [10.895927751576597, 5.882718243455158, 49.10878113434035]}}]', 'null', '{"left": {"moved": null, "drift": {"rotation_deg": 0.0, "position_m": 0.0, "pixels": 0.0}, "drift_since": 1}, "right": {"moved": null, "drift": {"rotation_deg": 0.0, "position_m": 0.0, "pixels": 0.0}, "drift_since": 1}}');
INSERT INTO public.revisions VALUES (7, 'failed', 1, '2026-11-23 17:55:38.000978+00', 'put', NULL, NULL, NULL, '[{"id": "left", "image_size": [64, 48], "intrinsics": {"model": "opencv", "matrix": [[60.0, 0.0, 32.0], [0.0, 60.0, 24.0], [0.0, 0.0, 1.0]], "distortion": [], "sigma": null}, "pose": {"rotation": [1.6, 0.1, -0.2], "position": [-1.0, -50.0, 8.0], "translation": [10.895927751576597, 5.882718243455158, 49.10878113434035]}}, {"id": "right", "image_size": [64, 48], "intrinsics": {"model": "opencv", "matrix": [[60.0, 0.0, 32.0], [0.0, 60.0, 24.0], [0.0, 0.0, 1.0]], "distortion": [], "sigma": null}, "pose": {"rotation": [1.6, 0.1, -0.2], "position": [-1.0, -50.0, 8.0], "translation": [10.895927751576597, 5.882718243455158, 49.10878113434035]}}]', 'null', '{"left": {"moved": null, "drift": {"rotation_deg": 0.0, "position_m": 0.0, "pixels": 0.0}, "drift_since": 1}, "right": {"moved": null, "drift": {"rotation_deg": 0.0, "position_m": 0.0, "pixels": 0.0}, "drift_since": 1}}');
INSERT INTO public.revisions VALUES (8, 'waiting', 1, '2026-11-23 17:55:45.400155+00', 'put', NULL, NULL, NULL, '[{"id": "left", "image_size": [64, 48], "intrinsics": {"model": "opencv", "matrix": [[60.0, 0.0, 32.0], [0.0, 60.0, 24.0], [0.0, 0.0, 1.0]], "distortion": [], "sigma": null}, "pose": {"rotation": [1.6, 0.1, -0.2], "position": [-1.0, -50.0, 8.0], "translation": [10.895927751576597, 5.882718243455158, 49.10878113434035]}}, {"id": "right", "image_size": [64, 48], "intrinsics": {"model": "opencv", "matrix": [[60.0, 0.0, 32.0], [0.0, 60.0, 24.0], [0.0, 0.0, 1.0]], "distortion": [], "sigma": null}, "pose": {"rotation": [1.6, 0.1, -0.2], "position": [-1.0, -50.0, 8.0], "translation": [10.895927751576597, 5.882718243455158, 49.10878113434035]}}]', 'null', '{"left": {"moved": null, "drift": {"rotation_deg": 0.0, "position_m": 0.0, "pixels": 0.0}, "drift_since": 1}, "right": {"moved": null, "drift": {"rotation_deg": 0.0, "position_m": 0.0, "pixels": 0.0}, "drift_since": 1}}');
INSERT INTO public.revisions VALUES (9, 'cancelled', 1, '2026-11-23 17:55:46.000746+00', 'put', NULL, NULL, NULL, '[{"id": "left", "image_size": [64, 48], "intrinsics": {"model": "opencv", "matrix": [[60.0, 0.0, 32.0], [0.0, 60.0, 24.0], [0.0, 0.0, 1.0]], "distortion": [], "sigma": null}, "pose": {"rotation": [1.6, 0.1, -0.2], "position": [-1.0, -50.0, 8.0], "translation": [10.895927751576597, 5.882718243455158, 49.10878113434035]}}, {"id": "right", "image_size": [64, 48], "intrinsics": {"model": "opencv", "matrix": [[60.0, 0.0, 32.0], [0.0, 60.0, 24.0], [0.0, 0.0, 1.0]], "distortion": [], "sigma": null}, "pose": {"rotation": [1.6, 0.1, -0.2], "position": [-1.0, -50.0, 8.0], "translation": [10.895927751576597, 5.882718243455158, 49.10878113434035]}}]', 'null', '{"left": {"moved": null, "drift": {"rotation_deg": 0.0, "position_m": 0.0, "pixels": 0.0}, "drift_since": 1}, "right": {"moved": null, "drift": {"rotation_deg": 0.0, "position_m": 0.0, "pixels": 0.0}, "drift_since": 1}}');
INSERT INTO public.schedules VALUES ('everything', '0 3 1 1 *', 'Europe/Berlin', false, '2027-01-01 02:09:24+00', '2027-01-01 02:09:24+00', NULL, NULL, NULL);
INSERT INTO public.tallies VALUES ('job_duration_bucket', '1', 1);
INSERT INTO public.tallies VALUES ('jobs_ended', 'succeeded,accepted,', 2);
INSERT INTO public.tallies VALUES ('jobs_ended', 'succeeded,rejected,', 1);
INSERT INTO public.tallies VALUES ('job_stitch_error_bucket', '0.2', 4);
INSERT INTO public.tallies VALUES ('job_stitch_error_sum', '', 0.8);
INSERT INTO public.tallies VALUES ('jobs_ended', 'succeeded,partly,', 1);
INSERT INTO public.tallies VALUES ('job_duration_bucket', '0.25', 4);
INSERT INTO public.tallies VALUES ('job_duration_sum', '', 1.3536270000000001);
INSERT INTO public.tallies VALUES ('job_wait_bucket', '1', 5);
INSERT INTO public.tallies VALUES ('job_wait_sum', '', 1.033989);
INSERT INTO public.tallies VALUES ('jobs_ended', 'failed,,no-markings-in-view', 1);
INSERT INTO public.tallies VALUES ('job_stage_bucket', 'decode,0.1', 5);
INSERT INTO public.tallies VALUES ('job_stage_sum', 'decode', 0.5);
INSERT INTO public.tallies VALUES ('other_jobs_ended', 'field,succeeded', 1);
INSERT INTO public.tallies VALUES ('job_restarts', '', 0);
INSERT INTO public.tallies VALUES ('other_jobs_ended', 'locate,failed', 1);
INSERT INTO public.tallies VALUES ('jobs_ended', 'cancelled,,', 1);
INSERT INTO public.venue_quality VALUES ('rejected', 10, 1, NULL, 0, 1, '{"left": {"accepted_at": null, "rejected_in_a_row": 1, "view": null}, "right": {"accepted_at": null, "rejected_in_a_row": 1, "view": null}}', '{"last": {"status": "succeeded", "finished_at": "2026-11-23T17:55:37.258657Z", "dry_run": false, "verdict": "rejected", "stitch_error_px": 0.2, "moved_px": 1.0}, "errors": [0.2], "limit_px": null}', NULL);
INSERT INTO public.venue_quality VALUES ('partly', 10, 1, NULL, 0, 0, NULL, '{"last": {"status": "succeeded", "finished_at": "2026-11-23T17:55:37.843229Z", "dry_run": true, "verdict": "partly", "stitch_error_px": 0.2, "moved_px": 1.0}, "errors": [0.2], "limit_px": null}', NULL);
INSERT INTO public.venue_quality VALUES ('failed', NULL, NULL, NULL, 0, 1, '{"left": {"accepted_at": null, "rejected_in_a_row": 1, "view": null}, "right": {"accepted_at": null, "rejected_in_a_row": 1, "view": null}}', '{"last": {"status": "failed", "finished_at": "2026-11-23T17:55:38.372129Z", "dry_run": false, "verdict": null, "stitch_error_px": null, "moved_px": null}, "errors": [], "limit_px": null}', NULL);
INSERT INTO public.venue_quality VALUES ('everything', NULL, 1, '2026-11-23 17:55:36.291659+00', 0, 0, '{"left": {"accepted_at": "2026-11-23T17:55:36.291659Z", "rejected_in_a_row": 0, "view": null}, "right": {"accepted_at": "2026-11-23T17:55:36.291659Z", "rejected_in_a_row": 0, "view": null}}', '{"last": {"status": "succeeded", "finished_at": "2026-11-23T17:55:36.304638Z", "dry_run": false, "verdict": "accepted", "stitch_error_px": 0.2, "moved_px": 1.0}, "errors": [0.2, 0.2], "limit_px": null}', NULL);
INSERT INTO public.venue_quality VALUES ('waiting', NULL, NULL, NULL, 0, 0, NULL, NULL, NULL);
INSERT INTO public.venue_quality VALUES ('cancelled', NULL, NULL, NULL, 0, 0, NULL, '{"last": {"status": "cancelled", "finished_at": "2026-11-23T17:55:46.145770Z", "dry_run": false, "verdict": null, "stitch_error_px": null, "moved_px": null}, "errors": [], "limit_px": null}', NULL);
INSERT INTO public.venues VALUES ('partly', '{"id": "partly", "name": "partly", "field": {"template": "football", "length_m": 105.0, "width_m": 68.0, "line_width_m": 0.12, "measures_m": {}, "ridge": null, "other_markings": []}, "cameras": [{"id": "left", "image_size": [64, 48], "intrinsics": {"model": "opencv", "matrix": [[60.0, 0.0, 32.0], [0.0, 60.0, 24.0], [0.0, 0.0, 1.0]], "distortion": [], "sigma": null}, "pose": {"rotation": [1.6, 0.1, -0.2], "position": [-1.0, -50.0, 8.0], "translation": [10.895927751576597, 5.882718243455158, 49.10878113434035]}, "ignore": [], "source": null}, {"id": "right", "image_size": [64, 48], "intrinsics": {"model": "opencv", "matrix": [[60.0, 0.0, 32.0], [0.0, 60.0, 24.0], [0.0, 0.0, 1.0]], "distortion": [], "sigma": null}, "pose": {"rotation": [1.6, 0.1, -0.2], "position": [-1.0, -50.0, 8.0], "translation": [10.895927751576597, 5.882718243455158, 49.10878113434035]}, "ignore": [], "source": null}], "accept": "each", "lens": "fixed", "alarms": null, "schedule": null, "webhooks": []}', '2026-11-23 17:55:37.466077+00');
INSERT INTO public.venues VALUES ('cancelled', '{"id": "cancelled", "name": "accept", "field": {"template": "football", "length_m": 105.0, "width_m": 68.0, "line_width_m": 0.12, "measures_m": {}, "ridge": null, "other_markings": []}, "cameras": [{"id": "left", "image_size": [64, 48], "intrinsics": {"model": "opencv", "matrix": [[60.0, 0.0, 32.0], [0.0, 60.0, 24.0], [0.0, 0.0, 1.0]], "distortion": [], "sigma": null}, "pose": {"rotation": [1.6, 0.1, -0.2], "position": [-1.0, -50.0, 8.0], "translation": [10.895927751576597, 5.882718243455158, 49.10878113434035]}, "ignore": [], "source": null}, {"id": "right", "image_size": [64, 48], "intrinsics": {"model": "opencv", "matrix": [[60.0, 0.0, 32.0], [0.0, 60.0, 24.0], [0.0, 0.0, 1.0]], "distortion": [], "sigma": null}, "pose": {"rotation": [1.6, 0.1, -0.2], "position": [-1.0, -50.0, 8.0], "translation": [10.895927751576597, 5.882718243455158, 49.10878113434035]}, "ignore": [], "source": null}], "accept": "each", "lens": "fixed", "alarms": null, "schedule": null, "webhooks": []}', '2026-11-23 17:55:45.984461+00');
INSERT INTO public.venues VALUES ('everything', '{"id": "everything", "name": "accept", "field": {"template": "football", "length_m": 105.0, "width_m": 68.0, "line_width_m": 0.12, "measures_m": {}, "ridge": [[-18.5, 0.0, 0.2], [18.5, 0.0, 0.2]], "other_markings": []}, "cameras": [{"id": "left", "image_size": [64, 48], "intrinsics": {"model": "opencv", "matrix": [[60.0, 0.0, 32.0], [0.0, 60.0, 24.0], [0.0, 0.0, 1.0]], "distortion": [], "sigma": null}, "pose": {"rotation": [1.6, 0.1, -0.2], "position": [-1.0, -50.0, 8.0], "translation": [10.895927751576597, 5.882718243455158, 49.10878113434035]}, "ignore": [[[0.0, 40.0], [20.0, 40.0], [20.0, 47.0]]], "source": "http://***@example.com/a.jpg"}, {"id": "right", "image_size": [64, 48], "intrinsics": {"model": "opencv", "matrix": [[60.0, 0.0, 32.0], [0.0, 60.0, 24.0], [0.0, 0.0, 1.0]], "distortion": [], "sigma": {"fx": 0.5}}, "pose": {"rotation": [1.6, 0.1, -0.2], "position": [-1.0, -50.0, 8.0], "translation": [10.895927751576597, 5.882718243455158, 49.10878113434035]}, "ignore": [], "source": "http://example.com/b.jpg"}], "accept": "all", "lens": "may-drift", "alarms": {"moved_since_last_px": null, "moved_since_first_px": 40.0, "rejected_in_a_row": 1, "not_calibrated_for_h": null, "callback_url": "https://example.com/alarms"}, "schedule": {"cron": "0 3 1 1 *", "time_zone": "Europe/Berlin", "exact": false, "options": {"priority": "routine", "timeout_s": null, "callback_url": null, "preset": "esc", "search": "auto", "seed": 3, "generations": 100, "parents": 64, "offspring": 128, "stitch_weight": 0.5, "flat": false, "fit_focal_length": false, "fit_ridge": false, "dry_run": false, "pictures": false}}, "webhooks": [{"url": "https://example.com/told", "events": ["poses.changed", "venue.*"]}]}', '2026-11-23 17:55:36.385789+00');
INSERT INTO public.venues VALUES ('rejected', '{"id": "rejected", "name": "reject", "field": {"template": "football", "length_m": 105.0, "width_m": 68.0, "line_width_m": 0.12, "measures_m": {}, "ridge": null, "other_markings": []}, "cameras": [{"id": "left", "image_size": [64, 48], "intrinsics": {"model": "opencv", "matrix": [[60.0, 0.0, 32.0], [0.0, 60.0, 24.0], [0.0, 0.0, 1.0]], "distortion": [], "sigma": null}, "pose": {"rotation": [1.6, 0.1, -0.2], "position": [-1.0, -50.0, 8.0], "translation": [10.895927751576597, 5.882718243455158, 49.10878113434035]}, "ignore": [], "source": null}, {"id": "right", "image_size": [64, 48], "intrinsics": {"model": "opencv", "matrix": [[60.0, 0.0, 32.0], [0.0, 60.0, 24.0], [0.0, 0.0, 1.0]], "distortion": [], "sigma": null}, "pose": {"rotation": [1.6, 0.1, -0.2], "position": [-1.0, -50.0, 8.0], "translation": [10.895927751576597, 5.882718243455158, 49.10878113434035]}, "ignore": [], "source": null}], "accept": "each", "lens": "fixed", "alarms": null, "schedule": null, "webhooks": []}', '2026-11-23 17:55:36.484569+00');
INSERT INTO public.venues VALUES ('failed', '{"id": "failed", "name": "fail", "field": {"template": "football", "length_m": 105.0, "width_m": 68.0, "line_width_m": 0.12, "measures_m": {}, "ridge": null, "other_markings": []}, "cameras": [{"id": "left", "image_size": [64, 48], "intrinsics": {"model": "opencv", "matrix": [[60.0, 0.0, 32.0], [0.0, 60.0, 24.0], [0.0, 0.0, 1.0]], "distortion": [], "sigma": null}, "pose": {"rotation": [1.6, 0.1, -0.2], "position": [-1.0, -50.0, 8.0], "translation": [10.895927751576597, 5.882718243455158, 49.10878113434035]}, "ignore": [], "source": null}, {"id": "right", "image_size": [64, 48], "intrinsics": {"model": "opencv", "matrix": [[60.0, 0.0, 32.0], [0.0, 60.0, 24.0], [0.0, 0.0, 1.0]], "distortion": [], "sigma": null}, "pose": {"rotation": [1.6, 0.1, -0.2], "position": [-1.0, -50.0, 8.0], "translation": [10.895927751576597, 5.882718243455158, 49.10878113434035]}, "ignore": [], "source": null}], "accept": "each", "lens": "fixed", "alarms": null, "schedule": null, "webhooks": []}', '2026-11-23 17:55:37.994251+00');
INSERT INTO public.venues VALUES ('waiting', '{"id": "waiting", "name": "accept", "field": {"template": "football", "length_m": 105.0, "width_m": 68.0, "line_width_m": 0.12, "measures_m": {}, "ridge": null, "other_markings": []}, "cameras": [{"id": "left", "image_size": [64, 48], "intrinsics": {"model": "opencv", "matrix": [[60.0, 0.0, 32.0], [0.0, 60.0, 24.0], [0.0, 0.0, 1.0]], "distortion": [], "sigma": null}, "pose": {"rotation": [1.6, 0.1, -0.2], "position": [-1.0, -50.0, 8.0], "translation": [10.895927751576597, 5.882718243455158, 49.10878113434035]}, "ignore": [], "source": null}, {"id": "right", "image_size": [64, 48], "intrinsics": {"model": "opencv", "matrix": [[60.0, 0.0, 32.0], [0.0, 60.0, 24.0], [0.0, 0.0, 1.0]], "distortion": [], "sigma": null}, "pose": {"rotation": [1.6, 0.1, -0.2], "position": [-1.0, -50.0, 8.0], "translation": [10.895927751576597, 5.882718243455158, 49.10878113434035]}, "ignore": [], "source": null}], "accept": "each", "lens": "fixed", "alarms": null, "schedule": null, "webhooks": []}', '2026-11-23 17:55:45.384724+00');
INSERT INTO public.workers VALUES ('vm', '2f782beca6c497e09ee1b67bd6a1202048f19e97f7e1364a58d415ce7b3ecd9e', '2026-11-23 17:55:33.284466+00', '2026-11-23 17:55:39.600405+00');
SELECT pg_catalog.setval('public.events_id_seq', 32, true);
SELECT pg_catalog.setval('public.revisions_id_seq', 9, true);
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
