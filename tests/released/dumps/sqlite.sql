BEGIN TRANSACTION;
CREATE TABLE alarms (
	venue VARCHAR(64) NOT NULL, 
	rule VARCHAR(32) NOT NULL, 
	camera VARCHAR(64) NOT NULL, 
	since DATETIME NOT NULL, 
	why VARCHAR(500) NOT NULL, 
	PRIMARY KEY (venue, rule, camera)
);
CREATE TABLE api_keys (
	name VARCHAR(64) NOT NULL, 
	hash VARCHAR(64) NOT NULL, 
	scope VARCHAR(16) NOT NULL, 
	created_at DATETIME NOT NULL, 
	expires_at DATETIME, 
	last_used_at DATETIME, 
	PRIMARY KEY (name)
);
CREATE TABLE application_versions (
    version_id TEXT NOT NULL PRIMARY KEY,
    version_name TEXT NOT NULL UNIQUE,
    version_timestamp INTEGER NOT NULL DEFAULT (strftime('%s','now') * 1000),
    created_at INTEGER NOT NULL DEFAULT (strftime('%s','now') * 1000)
, "application_name" TEXT DEFAULT NULL);
INSERT INTO "application_versions" VALUES('95f52b07-c00b-4942-ab03-f15b0529afa3','1',1795456507000,1795456507000,'esc');
CREATE TABLE credentials (
	venue VARCHAR(64) NOT NULL, 
	camera VARCHAR(64) NOT NULL, 
	userinfo VARCHAR(1024) NOT NULL, 
	PRIMARY KEY (venue, camera)
);
INSERT INTO "credentials" VALUES('everything','left','u:p');
CREATE TABLE dbos_migrations (version INTEGER NOT NULL PRIMARY KEY);
INSERT INTO "dbos_migrations" VALUES(125);
CREATE TABLE deliveries (
	id VARCHAR(26) NOT NULL, 
	url VARCHAR(2048) NOT NULL, 
	receiver VARCHAR(255) NOT NULL, 
	status VARCHAR(16) NOT NULL, 
	attempts INTEGER NOT NULL, 
	due_at DATETIME NOT NULL, 
	last_error VARCHAR(500), 
	event BIGINT, 
	PRIMARY KEY (id)
);
INSERT INTO "deliveries" VALUES('01M84RR8KCED968J0CMSH03JFD','https://example.com/told','example.com','waiting',1,'2026-11-23 17:55:15.099375','example.com cannot be looked up: [Errno -2] Name or service not known',1);
INSERT INTO "deliveries" VALUES('01M84RR8XDH547A7A04CSKX2BP','https://example.com/told','example.com','waiting',1,'2026-11-23 17:55:15.247670','example.com cannot be looked up: [Errno -2] Name or service not known',2);
INSERT INTO "deliveries" VALUES('01M84RR9WB1AE8WNQ8PDQS8HJK','https://example.com/told','example.com','waiting',2,'2026-11-23 17:55:47.974039','example.com cannot be looked up: [Errno -2] Name or service not known',4);
INSERT INTO "deliveries" VALUES('01M84RR8Z2WE431B8JGDM3XW8T','https://example.com/end','example.com','waiting',1,'2026-11-23 17:55:15.010382','example.com cannot be looked up: [Errno -2] Name or service not known',NULL);
INSERT INTO "deliveries" VALUES('01M84RRAHN9203514TCXQ5QFQH','https://example.com/told','example.com','waiting',1,'2026-11-23 17:55:16.165524','example.com cannot be looked up: [Errno -2] Name or service not known',7);
INSERT INTO "deliveries" VALUES('01M84RRATK6GCN7CJ5J0QPKXW6','https://example.com/told','example.com','waiting',1,'2026-11-23 17:55:16.261046','example.com cannot be looked up: [Errno -2] Name or service not known',9);
CREATE TABLE esc_schema (
	version_num VARCHAR(32) NOT NULL, 
	CONSTRAINT esc_schema_pkc PRIMARY KEY (version_num)
);
INSERT INTO "esc_schema" VALUES('0001');
CREATE TABLE events (
	id INTEGER NOT NULL PRIMARY KEY AUTOINCREMENT, 
	venue VARCHAR(64) NOT NULL, 
	type VARCHAR(32) NOT NULL, 
	at DATETIME NOT NULL, 
	data JSON, 
	job VARCHAR(26)
);
INSERT INTO "events" VALUES(1,'everything','venue.created','2026-11-23 17:55:08.523668','{"venue": "everything", "changed": []}',NULL);
INSERT INTO "events" VALUES(2,'everything','poses.changed','2026-11-23 17:55:08.532219','{"venue": "everything", "revision": 1, "cause": "put", "job": null, "stitch_error_px": null, "ridge": [[-18.5, 0.0, 0.2], [18.5, 0.0, 0.2]], "cameras": [{"id": "left", "image_size": [64, 48], "intrinsics": {"model": "opencv", "matrix": [[60.0, 0.0, 32.0], [0.0, 60.0, 24.0], [0.0, 0.0, 1.0]], "distortion": [], "sigma": null}, "pose": {"rotation": [1.6, 0.1, -0.2], "position": [-1.0, -50.0, 8.0], "translation": [10.895927751576597, 5.882718243455158, 49.10878113434035]}}, {"id": "right", "image_size": [64, 48], "intrinsics": {"model": "opencv", "matrix": [[60.0, 0.0, 32.0], [0.0, 60.0, 24.0], [0.0, 0.0, 1.0]], "distortion": [], "sigma": {"fx": 0.5}}, "pose": {"rotation": [1.6, 0.1, -0.2], "position": [-1.0, -50.0, 8.0], "translation": [10.895927751576597, 5.882718243455158, 49.10878113434035]}}], "changed": ["left", "right"]}',NULL);
INSERT INTO "events" VALUES(3,'everything','job.queued','2026-11-23 17:55:08.947191',NULL,'01M84RR8Z2WE431B8JGDM3XW8T');
INSERT INTO "events" VALUES(4,'everything','poses.changed','2026-11-23 17:55:09.555547','{"venue": "everything", "revision": 2, "cause": "calibrated", "job": "01M84RR8Z2WE431B8JGDM3XW8T", "stitch_error_px": 0.2, "ridge": [[-18.5, 0.0, 0.2], [18.5, 0.0, 0.2]], "cameras": [{"id": "left", "image_size": [64, 48], "intrinsics": {"model": "opencv", "matrix": [[60.0, 0.0, 32.0], [0.0, 60.0, 24.0], [0.0, 0.0, 1.0]], "distortion": [], "sigma": null}, "pose": {"rotation": [1.6, 0.1, -0.2], "position": [-0.875, -43.75, 7.0], "translation": [9.533936782629523, 5.147378463023263, 42.970183492547804]}}, {"id": "right", "image_size": [64, 48], "intrinsics": {"model": "opencv", "matrix": [[60.0, 0.0, 32.0], [0.0, 60.0, 24.0], [0.0, 0.0, 1.0]], "distortion": [], "sigma": {"fx": 0.5}}, "pose": {"rotation": [1.6, 0.1, -0.2], "position": [-0.875, -43.75, 7.0], "translation": [9.533936782629523, 5.147378463023263, 42.970183492547804]}}], "changed": ["left", "right"]}',NULL);
INSERT INTO "events" VALUES(5,'everything','job.succeeded','2026-11-23 17:55:09.842330',NULL,'01M84RR8Z2WE431B8JGDM3XW8T');
INSERT INTO "events" VALUES(6,'everything','job.queued','2026-11-23 17:55:10.069069',NULL,'01M84RRA28YNKEM16WFHXG8Q2B');
INSERT INTO "events" VALUES(7,'everything','poses.changed','2026-11-23 17:55:10.495668','{"venue": "everything", "revision": 3, "cause": "calibrated", "job": "01M84RRA28YNKEM16WFHXG8Q2B", "stitch_error_px": 0.2, "ridge": [[-18.5, 0.0, 0.2], [18.5, 0.0, 0.2]], "cameras": [{"id": "left", "image_size": [64, 48], "intrinsics": {"model": "opencv", "matrix": [[60.0, 0.0, 32.0], [0.0, 60.0, 24.0], [0.0, 0.0, 1.0]], "distortion": [], "sigma": null}, "pose": {"rotation": [1.6, 0.1, -0.2], "position": [-0.765625, -38.28125, 6.125], "translation": [8.342194684800832, 4.503956155145355, 37.59891055597933]}}, {"id": "right", "image_size": [64, 48], "intrinsics": {"model": "opencv", "matrix": [[60.0, 0.0, 32.0], [0.0, 60.0, 24.0], [0.0, 0.0, 1.0]], "distortion": [], "sigma": {"fx": 0.5}}, "pose": {"rotation": [1.6, 0.1, -0.2], "position": [-0.765625, -38.28125, 6.125], "translation": [8.342194684800832, 4.503956155145355, 37.59891055597933]}}], "changed": ["left", "right"]}',NULL);
INSERT INTO "events" VALUES(8,'everything','job.succeeded','2026-11-23 17:55:10.519188',NULL,'01M84RRA28YNKEM16WFHXG8Q2B');
INSERT INTO "events" VALUES(9,'everything','poses.changed','2026-11-23 17:55:10.783288','{"venue": "everything", "revision": 4, "cause": "restored", "job": null, "stitch_error_px": null, "ridge": [[-18.5, 0.0, 0.2], [18.5, 0.0, 0.2]], "cameras": [{"id": "left", "image_size": [64, 48], "intrinsics": {"model": "opencv", "matrix": [[60.0, 0.0, 32.0], [0.0, 60.0, 24.0], [0.0, 0.0, 1.0]], "distortion": [], "sigma": null}, "pose": {"rotation": [1.6, 0.1, -0.2], "position": [-1.0, -50.0, 8.0], "translation": [10.895927751576597, 5.882718243455158, 49.10878113434035]}}, {"id": "right", "image_size": [64, 48], "intrinsics": {"model": "opencv", "matrix": [[60.0, 0.0, 32.0], [0.0, 60.0, 24.0], [0.0, 0.0, 1.0]], "distortion": [], "sigma": {"fx": 0.5}}, "pose": {"rotation": [1.6, 0.1, -0.2], "position": [-1.0, -50.0, 8.0], "translation": [10.895927751576597, 5.882718243455158, 49.10878113434035]}}], "changed": ["left", "right"]}',NULL);
INSERT INTO "events" VALUES(10,'rejected','venue.created','2026-11-23 17:55:10.830926','{"venue": "rejected", "changed": []}',NULL);
INSERT INTO "events" VALUES(11,'rejected','poses.changed','2026-11-23 17:55:10.831335','{"venue": "rejected", "revision": 1, "cause": "put", "job": null, "stitch_error_px": null, "ridge": null, "cameras": [{"id": "left", "image_size": [64, 48], "intrinsics": {"model": "opencv", "matrix": [[60.0, 0.0, 32.0], [0.0, 60.0, 24.0], [0.0, 0.0, 1.0]], "distortion": [], "sigma": null}, "pose": {"rotation": [1.6, 0.1, -0.2], "position": [-1.0, -50.0, 8.0], "translation": [10.895927751576597, 5.882718243455158, 49.10878113434035]}}, {"id": "right", "image_size": [64, 48], "intrinsics": {"model": "opencv", "matrix": [[60.0, 0.0, 32.0], [0.0, 60.0, 24.0], [0.0, 0.0, 1.0]], "distortion": [], "sigma": null}, "pose": {"rotation": [1.6, 0.1, -0.2], "position": [-1.0, -50.0, 8.0], "translation": [10.895927751576597, 5.882718243455158, 49.10878113434035]}}], "changed": ["left", "right"]}',NULL);
INSERT INTO "events" VALUES(12,'rejected','job.queued','2026-11-23 17:55:11.032496',NULL,'01M84RRB0MEHG5FGJTH98BA0GH');
INSERT INTO "events" VALUES(13,'rejected','job.succeeded','2026-11-23 17:55:11.489105',NULL,'01M84RRB0MEHG5FGJTH98BA0GH');
INSERT INTO "events" VALUES(14,'partly','venue.created','2026-11-23 17:55:11.546483','{"venue": "partly", "changed": []}',NULL);
INSERT INTO "events" VALUES(15,'partly','poses.changed','2026-11-23 17:55:11.546915','{"venue": "partly", "revision": 1, "cause": "put", "job": null, "stitch_error_px": null, "ridge": null, "cameras": [{"id": "left", "image_size": [64, 48], "intrinsics": {"model": "opencv", "matrix": [[60.0, 0.0, 32.0], [0.0, 60.0, 24.0], [0.0, 0.0, 1.0]], "distortion": [], "sigma": null}, "pose": {"rotation": [1.6, 0.1, -0.2], "position": [-1.0, -50.0, 8.0], "translation": [10.895927751576597, 5.882718243455158, 49.10878113434035]}}, {"id": "right", "image_size": [64, 48], "intrinsics": {"model": "opencv", "matrix": [[60.0, 0.0, 32.0], [0.0, 60.0, 24.0], [0.0, 0.0, 1.0]], "distortion": [], "sigma": null}, "pose": {"rotation": [1.6, 0.1, -0.2], "position": [-1.0, -50.0, 8.0], "translation": [10.895927751576597, 5.882718243455158, 49.10878113434035]}}], "changed": ["left", "right"]}',NULL);
INSERT INTO "events" VALUES(16,'partly','job.queued','2026-11-23 17:55:11.667957',NULL,'01M84RRBKB5X4XSHAKR0R0X63P');
INSERT INTO "events" VALUES(17,'partly','job.succeeded','2026-11-23 17:55:12.054792',NULL,'01M84RRBKB5X4XSHAKR0R0X63P');
INSERT INTO "events" VALUES(18,'failed','venue.created','2026-11-23 17:55:12.308728','{"venue": "failed", "changed": []}',NULL);
INSERT INTO "events" VALUES(19,'failed','poses.changed','2026-11-23 17:55:12.309282','{"venue": "failed", "revision": 1, "cause": "put", "job": null, "stitch_error_px": null, "ridge": null, "cameras": [{"id": "left", "image_size": [64, 48], "intrinsics": {"model": "opencv", "matrix": [[60.0, 0.0, 32.0], [0.0, 60.0, 24.0], [0.0, 0.0, 1.0]], "distortion": [], "sigma": null}, "pose": {"rotation": [1.6, 0.1, -0.2], "position": [-1.0, -50.0, 8.0], "translation": [10.895927751576597, 5.882718243455158, 49.10878113434035]}}, {"id": "right", "image_size": [64, 48], "intrinsics": {"model": "opencv", "matrix": [[60.0, 0.0, 32.0], [0.0, 60.0, 24.0], [0.0, 0.0, 1.0]], "distortion": [], "sigma": null}, "pose": {"rotation": [1.6, 0.1, -0.2], "position": [-1.0, -50.0, 8.0], "translation": [10.895927751576597, 5.882718243455158, 49.10878113434035]}}], "changed": ["left", "right"]}',NULL);
INSERT INTO "events" VALUES(20,'failed','job.queued','2026-11-23 17:55:12.412755',NULL,'01M84RRCB2WV2NT6Z39NW5F7XA');
INSERT INTO "events" VALUES(21,'failed','job.failed','2026-11-23 17:55:13.055895',NULL,'01M84RRCB2WV2NT6Z39NW5F7XA');
INSERT INTO "events" VALUES(22,'rejected','job.queued','2026-11-23 17:55:13.401959',NULL,'01M84RRD9A7PT2JF5M6ZDVR5DA');
INSERT INTO "events" VALUES(23,'rejected','job.succeeded','2026-11-23 17:55:14.093478',NULL,'01M84RRD9A7PT2JF5M6ZDVR5DA');
INSERT INTO "events" VALUES(24,'rejected','job.queued','2026-11-23 17:55:14.360537',NULL,'01M84RRE96HZVVDZAF2X24AQ3C');
INSERT INTO "events" VALUES(25,'rejected','job.failed','2026-11-23 17:55:14.569991',NULL,'01M84RRE96HZVVDZAF2X24AQ3C');
INSERT INTO "events" VALUES(26,'waiting','venue.created','2026-11-23 17:55:19.613899','{"venue": "waiting", "changed": []}',NULL);
INSERT INTO "events" VALUES(27,'waiting','poses.changed','2026-11-23 17:55:19.615761','{"venue": "waiting", "revision": 1, "cause": "put", "job": null, "stitch_error_px": null, "ridge": null, "cameras": [{"id": "left", "image_size": [64, 48], "intrinsics": {"model": "opencv", "matrix": [[60.0, 0.0, 32.0], [0.0, 60.0, 24.0], [0.0, 0.0, 1.0]], "distortion": [], "sigma": null}, "pose": {"rotation": [1.6, 0.1, -0.2], "position": [-1.0, -50.0, 8.0], "translation": [10.895927751576597, 5.882718243455158, 49.10878113434035]}}, {"id": "right", "image_size": [64, 48], "intrinsics": {"model": "opencv", "matrix": [[60.0, 0.0, 32.0], [0.0, 60.0, 24.0], [0.0, 0.0, 1.0]], "distortion": [], "sigma": null}, "pose": {"rotation": [1.6, 0.1, -0.2], "position": [-1.0, -50.0, 8.0], "translation": [10.895927751576597, 5.882718243455158, 49.10878113434035]}}], "changed": ["left", "right"]}',NULL);
INSERT INTO "events" VALUES(28,'waiting','job.queued','2026-11-23 17:55:19.990906',NULL,'01M84RRKQK6NPNZ4VY5NN1VA42');
INSERT INTO "events" VALUES(29,'cancelled','venue.created','2026-11-23 17:55:20.078570','{"venue": "cancelled", "changed": []}',NULL);
INSERT INTO "events" VALUES(30,'cancelled','poses.changed','2026-11-23 17:55:20.079016','{"venue": "cancelled", "revision": 1, "cause": "put", "job": null, "stitch_error_px": null, "ridge": null, "cameras": [{"id": "left", "image_size": [64, 48], "intrinsics": {"model": "opencv", "matrix": [[60.0, 0.0, 32.0], [0.0, 60.0, 24.0], [0.0, 0.0, 1.0]], "distortion": [], "sigma": null}, "pose": {"rotation": [1.6, 0.1, -0.2], "position": [-1.0, -50.0, 8.0], "translation": [10.895927751576597, 5.882718243455158, 49.10878113434035]}}, {"id": "right", "image_size": [64, 48], "intrinsics": {"model": "opencv", "matrix": [[60.0, 0.0, 32.0], [0.0, 60.0, 24.0], [0.0, 0.0, 1.0]], "distortion": [], "sigma": null}, "pose": {"rotation": [1.6, 0.1, -0.2], "position": [-1.0, -50.0, 8.0], "translation": [10.895927751576597, 5.882718243455158, 49.10878113434035]}}], "changed": ["left", "right"]}',NULL);
INSERT INTO "events" VALUES(31,'cancelled','job.queued','2026-11-23 17:55:20.145761',NULL,'01M84RRKXA4W8G4EWGR8BBKEKX');
INSERT INTO "events" VALUES(32,'cancelled','job.cancelled','2026-11-23 17:55:20.160309',NULL,'01M84RRKXA4W8G4EWGR8BBKEKX');
CREATE TABLE jobs (
	id VARCHAR(26) NOT NULL, 
	kind VARCHAR(16) DEFAULT 'calibration' NOT NULL, 
	venue VARCHAR(64), 
	status VARCHAR(16) NOT NULL, 
	priority INTEGER NOT NULL, 
	options JSON NOT NULL, 
	content_hash VARCHAR(64) NOT NULL, 
	idempotency_key VARCHAR(255), 
	venue_document JSON NOT NULL, 
	frames JSON NOT NULL, 
	attempt INTEGER NOT NULL, 
	run_token VARCHAR(32), 
	revision INTEGER NOT NULL, 
	progress JSON, 
	result JSON, 
	pictures JSON, 
	error JSON, 
	created_at DATETIME NOT NULL, 
	started_at DATETIME, 
	finished_at DATETIME, 
	updated_at DATETIME NOT NULL, 
	frames_deleted_at DATETIME, 
	pictures_deleted_at DATETIME, 
	asked_by VARCHAR(80), 
	request_id VARCHAR(64), 
	traceparent VARCHAR(55), 
	PRIMARY KEY (id)
);
INSERT INTO "jobs" VALUES('01M84RR8Z2WE431B8JGDM3XW8T','calibration','everything','succeeded',100,'{"priority": "routine", "timeout_s": null, "callback_url": "https://example.com/end", "preset": "esc", "search": "auto", "seed": 1984449683, "generations": 100, "parents": 64, "offspring": 128, "stitch_weight": 0.5, "flat": false, "fit_focal_length": false, "fit_ridge": false, "dry_run": false, "pictures": false}','eafed287b216c15889fc967c7a1cbe23049be978c695b93e2c10844ef38ad42a','first','{"id": "everything", "name": "accept", "field": {"template": "football", "length_m": 105.0, "width_m": 68.0, "line_width_m": 0.12, "measures_m": {}, "ridge": [[-18.5, 0.0, 0.2], [18.5, 0.0, 0.2]], "other_markings": []}, "cameras": [{"id": "left", "image_size": [64, 48], "intrinsics": {"model": "opencv", "matrix": [[60.0, 0.0, 32.0], [0.0, 60.0, 24.0], [0.0, 0.0, 1.0]], "distortion": [], "sigma": null}, "pose": {"rotation": [1.6, 0.1, -0.2], "position": [-1.0, -50.0, 8.0], "translation": [10.895927751576597, 5.882718243455158, 49.10878113434035]}, "ignore": [[[0.0, 40.0], [20.0, 40.0], [20.0, 47.0]]], "source": "http://***@example.com/a.jpg"}, {"id": "right", "image_size": [64, 48], "intrinsics": {"model": "opencv", "matrix": [[60.0, 0.0, 32.0], [0.0, 60.0, 24.0], [0.0, 0.0, 1.0]], "distortion": [], "sigma": {"fx": 0.5}}, "pose": {"rotation": [1.6, 0.1, -0.2], "position": [-1.0, -50.0, 8.0], "translation": [10.895927751576597, 5.882718243455158, 49.10878113434035]}, "ignore": [], "source": "http://example.com/b.jpg"}], "accept": "all", "lens": "may-drift", "alarms": {"moved_since_last_px": null, "moved_since_first_px": 40.0, "rejected_in_a_row": 1, "not_calibrated_for_h": null, "callback_url": "https://example.com/alarms"}, "schedule": {"cron": "0 3 1 1 *", "time_zone": "Europe/Berlin", "exact": false, "options": {"priority": "routine", "timeout_s": null, "callback_url": null, "preset": "esc", "search": "auto", "seed": 3, "generations": 100, "parents": 64, "offspring": 128, "stitch_weight": 0.5, "flat": false, "fit_focal_length": false, "fit_ridge": false, "dry_run": false, "pictures": false}}, "webhooks": [{"url": "https://example.com/told", "events": ["poses.changed", "venue.*"]}]}','{"left": ["frames/01M84RR8Z2WE431B8JGDM3XW8T/left/0"], "right": ["frames/01M84RR8Z2WE431B8JGDM3XW8T/right/0"]}',1,'708047a854644caabc9676b73beb790f',4,'{"stage": "preview", "fraction": 1.0, "generation": null, "loss": null}','{"verdict": "accepted", "accepted": true, "rejected_because": null, "cameras": [{"id": "left", "accepted": true, "rejected_because": null, "refusal": null, "pose": {"rotation": [1.6, 0.1, -0.2], "position": [-0.875, -43.75, 7.0], "translation": [9.533936782629523, 5.147378463023263, 42.970183492547804]}, "intrinsics": null, "sigma": null, "repeatability": null, "moved": {"rotation_deg": 0.0, "position_m": 6.4, "pixels": 1.0}, "iou": 0.9, "expected_found": null, "unexpected": null, "found": null, "by_chance": null, "residual_px": 1.0, "view": null, "markings": []}, {"id": "right", "accepted": true, "rejected_because": null, "refusal": null, "pose": {"rotation": [1.6, 0.1, -0.2], "position": [-0.875, -43.75, 7.0], "translation": [9.533936782629523, 5.147378463023263, 42.970183492547804]}, "intrinsics": null, "sigma": null, "repeatability": null, "moved": {"rotation_deg": 0.0, "position_m": 6.4, "pixels": 1.0}, "iou": 0.9, "expected_found": null, "unexpected": null, "found": null, "by_chance": null, "residual_px": 1.0, "view": null, "markings": []}], "ridge": null, "diagnosis": [], "stitch_error_px": 0.2, "stitch_error_before_px": 10.0, "stitch_error_limit_px": null, "pairs": [], "loss": 0.1, "generations": 10, "path": "wide", "timings_s": {"decode": 0.1}, "cpu_s": {}, "provenance": {"software": "0", "model_sha256": "0", "seed": 1984449683, "options": {"priority": "routine", "timeout_s": null, "callback_url": null, "preset": "esc", "search": "auto", "seed": 1984449683, "generations": 100, "parents": 64, "offspring": 128, "stitch_weight": 0.5, "flat": false, "fit_focal_length": false, "fit_ridge": false, "dry_run": false, "pictures": false}}}','["preview", "birdseye", "overlay_left", "overlay_right"]',NULL,'2026-11-23 17:55:08.947191','2026-11-23 17:55:09.267436','2026-11-23 17:55:09.842330','2026-11-23 17:55:09.842330',NULL,NULL,NULL,'5716a5a435c14806a76aeeae574027e8',NULL);
INSERT INTO "jobs" VALUES('01M84RRA28YNKEM16WFHXG8Q2B','calibration','everything','succeeded',100,'{"priority": "routine", "timeout_s": null, "callback_url": null, "preset": "esc", "search": "auto", "seed": 1695520110, "generations": 100, "parents": 64, "offspring": 128, "stitch_weight": 0.5, "flat": true, "fit_focal_length": false, "fit_ridge": false, "dry_run": false, "pictures": false}','dfdcb0ca6abb47178127ebe2f08441dd7fc4a3c46b6f568e66a3e497c0cea502',NULL,'{"id": "everything", "name": "accept", "field": {"template": "football", "length_m": 105.0, "width_m": 68.0, "line_width_m": 0.12, "measures_m": {}, "ridge": [[-18.5, 0.0, 0.2], [18.5, 0.0, 0.2]], "other_markings": []}, "cameras": [{"id": "left", "image_size": [64, 48], "intrinsics": {"model": "opencv", "matrix": [[60.0, 0.0, 32.0], [0.0, 60.0, 24.0], [0.0, 0.0, 1.0]], "distortion": [], "sigma": null}, "pose": {"rotation": [1.6, 0.1, -0.2], "position": [-0.875, -43.75, 7.0], "translation": [9.533936782629523, 5.147378463023263, 42.970183492547804]}, "ignore": [[[0.0, 40.0], [20.0, 40.0], [20.0, 47.0]]], "source": "http://***@example.com/a.jpg"}, {"id": "right", "image_size": [64, 48], "intrinsics": {"model": "opencv", "matrix": [[60.0, 0.0, 32.0], [0.0, 60.0, 24.0], [0.0, 0.0, 1.0]], "distortion": [], "sigma": {"fx": 0.5}}, "pose": {"rotation": [1.6, 0.1, -0.2], "position": [-0.875, -43.75, 7.0], "translation": [9.533936782629523, 5.147378463023263, 42.970183492547804]}, "ignore": [], "source": "http://example.com/b.jpg"}], "accept": "all", "lens": "may-drift", "alarms": {"moved_since_last_px": null, "moved_since_first_px": 40.0, "rejected_in_a_row": 1, "not_calibrated_for_h": null, "callback_url": "https://example.com/alarms"}, "schedule": {"cron": "0 3 1 1 *", "time_zone": "Europe/Berlin", "exact": false, "options": {"priority": "routine", "timeout_s": null, "callback_url": null, "preset": "esc", "search": "auto", "seed": 3, "generations": 100, "parents": 64, "offspring": 128, "stitch_weight": 0.5, "flat": false, "fit_focal_length": false, "fit_ridge": false, "dry_run": false, "pictures": false}}, "webhooks": [{"url": "https://example.com/told", "events": ["poses.changed", "venue.*"]}]}','{"left": ["frames/01M84RRA28YNKEM16WFHXG8Q2B/left/0"], "right": ["frames/01M84RRA28YNKEM16WFHXG8Q2B/right/0"]}',1,'79e541a7e19543f68bb3d5c23723c3eb',4,'{"stage": "preview", "fraction": 1.0, "generation": null, "loss": null}','{"verdict": "accepted", "accepted": true, "rejected_because": null, "cameras": [{"id": "left", "accepted": true, "rejected_because": null, "refusal": null, "pose": {"rotation": [1.6, 0.1, -0.2], "position": [-0.765625, -38.28125, 6.125], "translation": [8.342194684800832, 4.503956155145355, 37.59891055597933]}, "intrinsics": null, "sigma": null, "repeatability": null, "moved": {"rotation_deg": 0.0, "position_m": 6.4, "pixels": 1.0}, "iou": 0.9, "expected_found": null, "unexpected": null, "found": null, "by_chance": null, "residual_px": 1.0, "view": null, "markings": []}, {"id": "right", "accepted": true, "rejected_because": null, "refusal": null, "pose": {"rotation": [1.6, 0.1, -0.2], "position": [-0.765625, -38.28125, 6.125], "translation": [8.342194684800832, 4.503956155145355, 37.59891055597933]}, "intrinsics": null, "sigma": null, "repeatability": null, "moved": {"rotation_deg": 0.0, "position_m": 6.4, "pixels": 1.0}, "iou": 0.9, "expected_found": null, "unexpected": null, "found": null, "by_chance": null, "residual_px": 1.0, "view": null, "markings": []}], "ridge": null, "diagnosis": [], "stitch_error_px": 0.2, "stitch_error_before_px": 10.0, "stitch_error_limit_px": null, "pairs": [], "loss": 0.1, "generations": 10, "path": "wide", "timings_s": {"decode": 0.1}, "cpu_s": {}, "provenance": {"software": "0", "model_sha256": "0", "seed": 1695520110, "options": {"priority": "routine", "timeout_s": null, "callback_url": null, "preset": "esc", "search": "auto", "seed": 1695520110, "generations": 100, "parents": 64, "offspring": 128, "stitch_weight": 0.5, "flat": true, "fit_focal_length": false, "fit_ridge": false, "dry_run": false, "pictures": false}}}','["preview", "birdseye", "overlay_left", "overlay_right"]',NULL,'2026-11-23 17:55:10.069069','2026-11-23 17:55:10.302726','2026-11-23 17:55:10.519188','2026-11-23 17:55:10.519188',NULL,NULL,NULL,'cf2113cb1b694cf3a6259fd6bc12fe40',NULL);
INSERT INTO "jobs" VALUES('01M84RRB0MEHG5FGJTH98BA0GH','calibration','rejected','succeeded',100,'{"priority": "routine", "timeout_s": null, "callback_url": null, "preset": "esc", "search": "auto", "seed": 949697661, "generations": 100, "parents": 64, "offspring": 128, "stitch_weight": 0.5, "flat": false, "fit_focal_length": false, "fit_ridge": false, "dry_run": false, "pictures": false}','166038974189b3168e8b65814acd6a80f17651bf65e8b2a4a5218378ef574326',NULL,'{"id": "rejected", "name": "reject", "field": {"template": "football", "length_m": 105.0, "width_m": 68.0, "line_width_m": 0.12, "measures_m": {}, "ridge": null, "other_markings": []}, "cameras": [{"id": "left", "image_size": [64, 48], "intrinsics": {"model": "opencv", "matrix": [[60.0, 0.0, 32.0], [0.0, 60.0, 24.0], [0.0, 0.0, 1.0]], "distortion": [], "sigma": null}, "pose": {"rotation": [1.6, 0.1, -0.2], "position": [-1.0, -50.0, 8.0], "translation": [10.895927751576597, 5.882718243455158, 49.10878113434035]}, "ignore": [], "source": null}, {"id": "right", "image_size": [64, 48], "intrinsics": {"model": "opencv", "matrix": [[60.0, 0.0, 32.0], [0.0, 60.0, 24.0], [0.0, 0.0, 1.0]], "distortion": [], "sigma": null}, "pose": {"rotation": [1.6, 0.1, -0.2], "position": [-1.0, -50.0, 8.0], "translation": [10.895927751576597, 5.882718243455158, 49.10878113434035]}, "ignore": [], "source": null}], "accept": "each", "lens": "fixed", "alarms": null, "schedule": null, "webhooks": []}','{"left": ["frames/01M84RRB0MEHG5FGJTH98BA0GH/left/0"], "right": ["frames/01M84RRB0MEHG5FGJTH98BA0GH/right/0"]}',1,'cd56f1a8874c413ab80ffe7c748a6797',4,'{"stage": "preview", "fraction": 1.0, "generation": null, "loss": null}','{"verdict": "rejected", "accepted": false, "rejected_because": "the lines do not fit", "cameras": [{"id": "left", "accepted": false, "rejected_because": "the lines do not fit", "refusal": null, "pose": {"rotation": [1.6, 0.1, -0.2], "position": [-0.875, -43.75, 7.0], "translation": [9.533936782629523, 5.147378463023263, 42.970183492547804]}, "intrinsics": null, "sigma": null, "repeatability": null, "moved": {"rotation_deg": 0.0, "position_m": 6.4, "pixels": 1.0}, "iou": 0.9, "expected_found": null, "unexpected": null, "found": null, "by_chance": null, "residual_px": 1.0, "view": null, "markings": []}, {"id": "right", "accepted": false, "rejected_because": "the lines do not fit", "refusal": null, "pose": {"rotation": [1.6, 0.1, -0.2], "position": [-0.875, -43.75, 7.0], "translation": [9.533936782629523, 5.147378463023263, 42.970183492547804]}, "intrinsics": null, "sigma": null, "repeatability": null, "moved": {"rotation_deg": 0.0, "position_m": 6.4, "pixels": 1.0}, "iou": 0.9, "expected_found": null, "unexpected": null, "found": null, "by_chance": null, "residual_px": 1.0, "view": null, "markings": []}], "ridge": null, "diagnosis": [], "stitch_error_px": 0.2, "stitch_error_before_px": 10.0, "stitch_error_limit_px": null, "pairs": [], "loss": 0.1, "generations": 10, "path": "wide", "timings_s": {"decode": 0.1}, "cpu_s": {}, "provenance": {"software": "0", "model_sha256": "0", "seed": 949697661, "options": {"priority": "routine", "timeout_s": null, "callback_url": null, "preset": "esc", "search": "auto", "seed": 949697661, "generations": 100, "parents": 64, "offspring": 128, "stitch_weight": 0.5, "flat": false, "fit_focal_length": false, "fit_ridge": false, "dry_run": false, "pictures": false}}}','["birdseye", "overlay_left", "overlay_right"]',NULL,'2026-11-23 17:55:11.032496','2026-11-23 17:55:11.334522','2026-11-23 17:55:11.489105','2026-11-23 17:55:11.489105',NULL,NULL,NULL,'ff9fd2f80d784b4f98d4aa92d59538b4',NULL);
INSERT INTO "jobs" VALUES('01M84RRBKB5X4XSHAKR0R0X63P','calibration','partly','succeeded',100,'{"priority": "routine", "timeout_s": null, "callback_url": null, "preset": "esc", "search": "auto", "seed": 895028907, "generations": 100, "parents": 64, "offspring": 128, "stitch_weight": 0.5, "flat": false, "fit_focal_length": false, "fit_ridge": false, "dry_run": true, "pictures": false}','72931535960c38863760dc0e9ff187aa99d3d4304bc2a5ba4ea5fa11848e27e9',NULL,'{"id": "partly", "name": "partly", "field": {"template": "football", "length_m": 105.0, "width_m": 68.0, "line_width_m": 0.12, "measures_m": {}, "ridge": null, "other_markings": []}, "cameras": [{"id": "left", "image_size": [64, 48], "intrinsics": {"model": "opencv", "matrix": [[60.0, 0.0, 32.0], [0.0, 60.0, 24.0], [0.0, 0.0, 1.0]], "distortion": [], "sigma": null}, "pose": {"rotation": [1.6, 0.1, -0.2], "position": [-1.0, -50.0, 8.0], "translation": [10.895927751576597, 5.882718243455158, 49.10878113434035]}, "ignore": [], "source": null}, {"id": "right", "image_size": [64, 48], "intrinsics": {"model": "opencv", "matrix": [[60.0, 0.0, 32.0], [0.0, 60.0, 24.0], [0.0, 0.0, 1.0]], "distortion": [], "sigma": null}, "pose": {"rotation": [1.6, 0.1, -0.2], "position": [-1.0, -50.0, 8.0], "translation": [10.895927751576597, 5.882718243455158, 49.10878113434035]}, "ignore": [], "source": null}], "accept": "each", "lens": "fixed", "alarms": null, "schedule": null, "webhooks": []}','{"left": ["frames/01M84RRBKB5X4XSHAKR0R0X63P/left/0"], "right": ["frames/01M84RRBKB5X4XSHAKR0R0X63P/right/0"]}',1,'6533079aa5994154afda39c8a7e8d3a2',4,'{"stage": "preview", "fraction": 1.0, "generation": null, "loss": null}','{"verdict": "partly", "accepted": false, "rejected_because": "the lines do not fit", "cameras": [{"id": "left", "accepted": true, "rejected_because": null, "refusal": null, "pose": {"rotation": [1.6, 0.1, -0.2], "position": [-0.875, -43.75, 7.0], "translation": [9.533936782629523, 5.147378463023263, 42.970183492547804]}, "intrinsics": null, "sigma": null, "repeatability": null, "moved": {"rotation_deg": 0.0, "position_m": 6.4, "pixels": 1.0}, "iou": 0.9, "expected_found": null, "unexpected": null, "found": null, "by_chance": null, "residual_px": 1.0, "view": null, "markings": []}, {"id": "right", "accepted": false, "rejected_because": "the lines do not fit", "refusal": null, "pose": {"rotation": [1.6, 0.1, -0.2], "position": [-0.875, -43.75, 7.0], "translation": [9.533936782629523, 5.147378463023263, 42.970183492547804]}, "intrinsics": null, "sigma": null, "repeatability": null, "moved": {"rotation_deg": 0.0, "position_m": 6.4, "pixels": 1.0}, "iou": 0.9, "expected_found": null, "unexpected": null, "found": null, "by_chance": null, "residual_px": 1.0, "view": null, "markings": []}], "ridge": null, "diagnosis": [], "stitch_error_px": 0.2, "stitch_error_before_px": 10.0, "stitch_error_limit_px": null, "pairs": [], "loss": 0.1, "generations": 10, "path": "wide", "timings_s": {"decode": 0.1}, "cpu_s": {}, "provenance": {"software": "0", "model_sha256": "0", "seed": 895028907, "options": {"priority": "routine", "timeout_s": null, "callback_url": null, "preset": "esc", "search": "auto", "seed": 895028907, "generations": 100, "parents": 64, "offspring": 128, "stitch_weight": 0.5, "flat": false, "fit_focal_length": false, "fit_ridge": false, "dry_run": true, "pictures": false}}}','["preview", "birdseye", "overlay_left", "overlay_right"]',NULL,'2026-11-23 17:55:11.667957','2026-11-23 17:55:11.882173','2026-11-23 17:55:12.054792','2026-11-23 17:55:12.054792',NULL,NULL,NULL,'6c171eead1a34270b58048b315648f69',NULL);
INSERT INTO "jobs" VALUES('01M84RRCB2WV2NT6Z39NW5F7XA','calibration','failed','failed',100,'{"priority": "routine", "timeout_s": null, "callback_url": null, "preset": "esc", "search": "auto", "seed": 1515148971, "generations": 100, "parents": 64, "offspring": 128, "stitch_weight": 0.5, "flat": false, "fit_focal_length": false, "fit_ridge": false, "dry_run": false, "pictures": false}','166038974189b3168e8b65814acd6a80f17651bf65e8b2a4a5218378ef574326',NULL,'{"id": "failed", "name": "fail", "field": {"template": "football", "length_m": 105.0, "width_m": 68.0, "line_width_m": 0.12, "measures_m": {}, "ridge": null, "other_markings": []}, "cameras": [{"id": "left", "image_size": [64, 48], "intrinsics": {"model": "opencv", "matrix": [[60.0, 0.0, 32.0], [0.0, 60.0, 24.0], [0.0, 0.0, 1.0]], "distortion": [], "sigma": null}, "pose": {"rotation": [1.6, 0.1, -0.2], "position": [-1.0, -50.0, 8.0], "translation": [10.895927751576597, 5.882718243455158, 49.10878113434035]}, "ignore": [], "source": null}, {"id": "right", "image_size": [64, 48], "intrinsics": {"model": "opencv", "matrix": [[60.0, 0.0, 32.0], [0.0, 60.0, 24.0], [0.0, 0.0, 1.0]], "distortion": [], "sigma": null}, "pose": {"rotation": [1.6, 0.1, -0.2], "position": [-1.0, -50.0, 8.0], "translation": [10.895927751576597, 5.882718243455158, 49.10878113434035]}, "ignore": [], "source": null}], "accept": "each", "lens": "fixed", "alarms": null, "schedule": null, "webhooks": []}','{"left": ["frames/01M84RRCB2WV2NT6Z39NW5F7XA/left/0"], "right": ["frames/01M84RRCB2WV2NT6Z39NW5F7XA/right/0"]}',1,'7e0719a7f06942ca90327a4869002174',4,'{"stage": "segmentation", "fraction": 0.1, "generation": null, "loss": null}',NULL,NULL,'{"type": "/problems/no-markings-in-view", "title": "", "detail": "It is black.", "camera": "left"}','2026-11-23 17:55:12.412755','2026-11-23 17:55:12.900452','2026-11-23 17:55:13.055895','2026-11-23 17:55:13.055895',NULL,NULL,NULL,'6236d1c84c8348c1be10fc79f441fada',NULL);
INSERT INTO "jobs" VALUES('01M84RRD9A7PT2JF5M6ZDVR5DA','field','rejected','succeeded',100,'{"priority": "routine", "timeout_s": null, "callback_url": null, "seed": 678010134}','6f8bf866d481fd5c00a602017513785d63eee08a51e5096e6dd43c9cb1427ee2',NULL,'{"id": "rejected", "name": "reject", "field": {"template": "football", "length_m": 105.0, "width_m": 68.0, "line_width_m": 0.12, "measures_m": {}, "ridge": null, "other_markings": []}, "cameras": [{"id": "left", "image_size": [64, 48], "intrinsics": {"model": "opencv", "matrix": [[60.0, 0.0, 32.0], [0.0, 60.0, 24.0], [0.0, 0.0, 1.0]], "distortion": [], "sigma": null}, "pose": {"rotation": [1.6, 0.1, -0.2], "position": [-1.0, -50.0, 8.0], "translation": [10.895927751576597, 5.882718243455158, 49.10878113434035]}, "ignore": [], "source": null}, {"id": "right", "image_size": [64, 48], "intrinsics": {"model": "opencv", "matrix": [[60.0, 0.0, 32.0], [0.0, 60.0, 24.0], [0.0, 0.0, 1.0]], "distortion": [], "sigma": null}, "pose": {"rotation": [1.6, 0.1, -0.2], "position": [-1.0, -50.0, 8.0], "translation": [10.895927751576597, 5.882718243455158, 49.10878113434035]}, "ignore": [], "source": null}], "accept": "each", "lens": "fixed", "alarms": null, "schedule": null, "webhooks": []}','{"left": ["frames/01M84RRD9A7PT2JF5M6ZDVR5DA/left/0"], "right": ["frames/01M84RRD9A7PT2JF5M6ZDVR5DA/right/0"]}',1,'6b742456b6a94f339f2d706aca47f9ac',4,'{"stage": "preview", "fraction": 1.0, "generation": null, "loss": null}','{"accepted": false, "rejected_because": "the lines do not fit", "field": {"template": "football", "length_m": 104.25, "width_m": 68.0, "line_width_m": 0.12, "measures_m": {}, "ridge": null, "other_markings": []}, "measures": [{"name": "length_m", "given": 105.0, "value": 104.25, "sigma": 0.05, "open": 5.0, "known": true, "detail": ""}, {"name": "width_m", "given": 68.0, "value": 67.0, "sigma": 5.0, "open": 5.0, "known": false, "detail": "no line seen"}], "cameras": [{"id": "left", "accepted": false, "rejected_because": "the lines do not fit", "refusal": null, "pose": {"rotation": [1.6, 0.1, -0.2], "position": [-0.875, -43.75, 7.0], "translation": [9.533936782629523, 5.147378463023263, 42.970183492547804]}, "intrinsics": null, "sigma": null, "repeatability": null, "moved": {"rotation_deg": 0.0, "position_m": 6.4, "pixels": 1.0}, "iou": 0.9, "expected_found": null, "unexpected": null, "found": null, "by_chance": null, "residual_px": 1.0, "view": null, "markings": []}, {"id": "right", "accepted": false, "rejected_because": "the lines do not fit", "refusal": null, "pose": {"rotation": [1.6, 0.1, -0.2], "position": [-0.875, -43.75, 7.0], "translation": [9.533936782629523, 5.147378463023263, 42.970183492547804]}, "intrinsics": null, "sigma": null, "repeatability": null, "moved": {"rotation_deg": 0.0, "position_m": 6.4, "pixels": 1.0}, "iou": 0.9, "expected_found": null, "unexpected": null, "found": null, "by_chance": null, "residual_px": 1.0, "view": null, "markings": []}], "stitch_error_px": 0.2, "timings_s": {"decode": 0.1}, "cpu_s": {}, "provenance": {"software": "0", "model_sha256": "0", "seed": 678010134, "options": {"priority": "routine", "timeout_s": null, "callback_url": null, "seed": 678010134}}}','["overlay_right"]',NULL,'2026-11-23 17:55:13.401959','2026-11-23 17:55:13.925909','2026-11-23 17:55:14.093478','2026-11-23 17:55:14.093478',NULL,NULL,NULL,'73f95a4149cb4951a261c9c4fbd31d39',NULL);
INSERT INTO "jobs" VALUES('01M84RRE96HZVVDZAF2X24AQ3C','locate','rejected','failed',100,'{"priority": "routine", "timeout_s": null, "callback_url": null, "points": [{"world": [0.0, 0.0], "pixel": [5.0, 5.0]}, {"world": [0.0, 1.0], "pixel": [5.0, 15.0]}, {"world": [1.0, 0.0], "pixel": [15.0, 5.0]}, {"world": [1.0, 1.0], "pixel": [15.0, 15.0]}]}','37d329fd1d09cf2464de1c1cce636e901ba74c23700bf257d6268bbbe60cad1f',NULL,'{"id": "rejected", "name": "reject", "field": {"template": "football", "length_m": 105.0, "width_m": 68.0, "line_width_m": 0.12, "measures_m": {}, "ridge": null, "other_markings": []}, "cameras": [{"id": "left", "image_size": [64, 48], "intrinsics": {"model": "opencv", "matrix": [[60.0, 0.0, 32.0], [0.0, 60.0, 24.0], [0.0, 0.0, 1.0]], "distortion": [], "sigma": null}, "pose": {"rotation": [1.6, 0.1, -0.2], "position": [-1.0, -50.0, 8.0], "translation": [10.895927751576597, 5.882718243455158, 49.10878113434035]}, "ignore": [], "source": null}, {"id": "right", "image_size": [64, 48], "intrinsics": {"model": "opencv", "matrix": [[60.0, 0.0, 32.0], [0.0, 60.0, 24.0], [0.0, 0.0, 1.0]], "distortion": [], "sigma": null}, "pose": {"rotation": [1.6, 0.1, -0.2], "position": [-1.0, -50.0, 8.0], "translation": [10.895927751576597, 5.882718243455158, 49.10878113434035]}, "ignore": [], "source": null}], "accept": "each", "lens": "fixed", "alarms": null, "schedule": null, "webhooks": []}','{"left": []}',1,'314ab1a9c7c04a968c7e525ba5495d4a',4,'{"stage": "segmentation", "fraction": 0.1, "generation": null, "loss": null}',NULL,NULL,'{"type": "/problems/no-pose", "title": "", "detail": "This program only moves cameras.", "camera": null}','2026-11-23 17:55:14.360537','2026-11-23 17:55:14.418169','2026-11-23 17:55:14.569991','2026-11-23 17:55:14.569991',NULL,NULL,NULL,'a8b75cf20cd54292aa014428755c6f56',NULL);
INSERT INTO "jobs" VALUES('01M84RRKQK6NPNZ4VY5NN1VA42','calibration','waiting','queued',100,'{"priority": "routine", "timeout_s": null, "callback_url": null, "preset": "esc", "search": "auto", "seed": 499967753, "generations": 100, "parents": 64, "offspring": 128, "stitch_weight": 0.5, "flat": false, "fit_focal_length": false, "fit_ridge": false, "dry_run": false, "pictures": false}','166038974189b3168e8b65814acd6a80f17651bf65e8b2a4a5218378ef574326','waits','{"id": "waiting", "name": "accept", "field": {"template": "football", "length_m": 105.0, "width_m": 68.0, "line_width_m": 0.12, "measures_m": {}, "ridge": null, "other_markings": []}, "cameras": [{"id": "left", "image_size": [64, 48], "intrinsics": {"model": "opencv", "matrix": [[60.0, 0.0, 32.0], [0.0, 60.0, 24.0], [0.0, 0.0, 1.0]], "distortion": [], "sigma": null}, "pose": {"rotation": [1.6, 0.1, -0.2], "position": [-1.0, -50.0, 8.0], "translation": [10.895927751576597, 5.882718243455158, 49.10878113434035]}, "ignore": [], "source": null}, {"id": "right", "image_size": [64, 48], "intrinsics": {"model": "opencv", "matrix": [[60.0, 0.0, 32.0], [0.0, 60.0, 24.0], [0.0, 0.0, 1.0]], "distortion": [], "sigma": null}, "pose": {"rotation": [1.6, 0.1, -0.2], "position": [-1.0, -50.0, 8.0], "translation": [10.895927751576597, 5.882718243455158, 49.10878113434035]}, "ignore": [], "source": null}], "accept": "each", "lens": "fixed", "alarms": null, "schedule": null, "webhooks": []}','{"left": ["frames/01M84RRKQK6NPNZ4VY5NN1VA42/left/0"], "right": ["frames/01M84RRKQK6NPNZ4VY5NN1VA42/right/0"]}',0,NULL,1,NULL,NULL,NULL,NULL,'2026-11-23 17:55:19.990906',NULL,NULL,'2026-11-23 17:55:19.990906',NULL,NULL,NULL,'b9e0b08905cf4d14ba47548471e3b6f8',NULL);
INSERT INTO "jobs" VALUES('01M84RRKXA4W8G4EWGR8BBKEKX','calibration','cancelled','cancelled',100,'{"priority": "routine", "timeout_s": null, "callback_url": null, "preset": "esc", "search": "auto", "seed": 501966771, "generations": 100, "parents": 64, "offspring": 128, "stitch_weight": 0.5, "flat": false, "fit_focal_length": false, "fit_ridge": false, "dry_run": false, "pictures": false}','166038974189b3168e8b65814acd6a80f17651bf65e8b2a4a5218378ef574326',NULL,'{"id": "cancelled", "name": "accept", "field": {"template": "football", "length_m": 105.0, "width_m": 68.0, "line_width_m": 0.12, "measures_m": {}, "ridge": null, "other_markings": []}, "cameras": [{"id": "left", "image_size": [64, 48], "intrinsics": {"model": "opencv", "matrix": [[60.0, 0.0, 32.0], [0.0, 60.0, 24.0], [0.0, 0.0, 1.0]], "distortion": [], "sigma": null}, "pose": {"rotation": [1.6, 0.1, -0.2], "position": [-1.0, -50.0, 8.0], "translation": [10.895927751576597, 5.882718243455158, 49.10878113434035]}, "ignore": [], "source": null}, {"id": "right", "image_size": [64, 48], "intrinsics": {"model": "opencv", "matrix": [[60.0, 0.0, 32.0], [0.0, 60.0, 24.0], [0.0, 0.0, 1.0]], "distortion": [], "sigma": null}, "pose": {"rotation": [1.6, 0.1, -0.2], "position": [-1.0, -50.0, 8.0], "translation": [10.895927751576597, 5.882718243455158, 49.10878113434035]}, "ignore": [], "source": null}], "accept": "each", "lens": "fixed", "alarms": null, "schedule": null, "webhooks": []}','{"left": ["frames/01M84RRKXA4W8G4EWGR8BBKEKX/left/0"], "right": ["frames/01M84RRKXA4W8G4EWGR8BBKEKX/right/0"]}',0,NULL,2,NULL,NULL,NULL,NULL,'2026-11-23 17:55:20.145761',NULL,'2026-11-23 17:55:20.160309','2026-11-23 17:55:20.160309',NULL,NULL,NULL,'027f74d37e154258826ec9f58a42e1ea',NULL);
CREATE TABLE leftovers (
	folder VARCHAR(255) NOT NULL, 
	due_at DATETIME NOT NULL, 
	PRIMARY KEY (folder)
);
CREATE TABLE notifications (
    message_uuid TEXT NOT NULL DEFAULT (hex(randomblob(16))) PRIMARY KEY,
    destination_uuid TEXT NOT NULL,
    topic TEXT,
    message TEXT NOT NULL,
    created_at_epoch_ms INTEGER NOT NULL DEFAULT (strftime('%s','now') * 1000), "serialization" TEXT DEFAULT NULL, "consumed" BOOLEAN NOT NULL DEFAULT FALSE, consumed_by_function_id INTEGER,
    FOREIGN KEY (destination_uuid) REFERENCES workflow_status(workflow_uuid) 
        ON UPDATE CASCADE ON DELETE CASCADE
);
CREATE TABLE "operation_outputs" (
    workflow_uuid TEXT NOT NULL,
    function_id INTEGER NOT NULL,
    function_name TEXT NOT NULL DEFAULT '',
    output TEXT,
    error TEXT,
    child_workflow_id TEXT,
    started_at_epoch_ms INTEGER,
    completed_at_epoch_ms INTEGER,
    serialization TEXT,
    application_name TEXT DEFAULT NULL,
    retention_timestamp INTEGER NOT NULL DEFAULT (strftime('%s','now') * 1000),
    PRIMARY KEY (workflow_uuid, function_id)
);
CREATE TABLE queues (
    queue_id TEXT PRIMARY KEY DEFAULT (hex(randomblob(16))),
    name TEXT NOT NULL UNIQUE,
    concurrency INTEGER,
    worker_concurrency INTEGER,
    rate_limit_max INTEGER,
    rate_limit_period_sec REAL,
    priority_enabled BOOLEAN NOT NULL DEFAULT FALSE,
    partition_queue BOOLEAN NOT NULL DEFAULT FALSE,
    polling_interval_sec REAL NOT NULL DEFAULT 1.0,
    created_at INTEGER NOT NULL DEFAULT (strftime('%s','now') * 1000),
    updated_at INTEGER NOT NULL DEFAULT (strftime('%s','now') * 1000)
, "application_name" TEXT DEFAULT NULL, "partition_concurrency" INTEGER DEFAULT NULL, "partition_worker_concurrency" INTEGER DEFAULT NULL, "partition_rate_limit_max" INTEGER DEFAULT NULL, "partition_rate_limit_period_sec" REAL DEFAULT NULL);
INSERT INTO "queues" VALUES('0CE03CF8F49E74F0D764AC13A45B9438','calibration',NULL,1,NULL,NULL,1,0,0.5,1795456507000,1795456507768,'esc',NULL,NULL,NULL,NULL);
INSERT INTO "queues" VALUES('0C3EA7AF8FC29C8E32D870E2F0E23583','light',NULL,1,NULL,NULL,1,0,0.5,1795456507000,1795456507785,'esc',NULL,NULL,NULL,NULL);
CREATE TABLE revisions (
	id INTEGER NOT NULL, 
	venue VARCHAR(64) NOT NULL, 
	number INTEGER NOT NULL, 
	at DATETIME NOT NULL, 
	cause VARCHAR(16) NOT NULL, 
	job VARCHAR(26), 
	restored_from INTEGER, 
	stitch_error_px DOUBLE, 
	cameras JSON NOT NULL, 
	ridge JSON NOT NULL, 
	movements JSON NOT NULL, 
	PRIMARY KEY (id)
);
INSERT INTO "revisions" VALUES(1,'everything',1,'2026-11-23 17:55:08.532219','put',NULL,NULL,NULL,'[{"id": "left", "image_size": [64, 48], "intrinsics": {"model": "opencv", "matrix": [[60.0, 0.0, 32.0], [0.0, 60.0, 24.0], [0.0, 0.0, 1.0]], "distortion": [], "sigma": null}, "pose": {"rotation": [1.6, 0.1, -0.2], "position": [-1.0, -50.0, 8.0], "translation": [10.895927751576597, 5.882718243455158, 49.10878113434035]}}, {"id": "right", "image_size": [64, 48], "intrinsics": {"model": "opencv", "matrix": [[60.0, 0.0, 32.0], [0.0, 60.0, 24.0], [0.0, 0.0, 1.0]], "distortion": [], "sigma": {"fx": 0.5}}, "pose": {"rotation": [1.6, 0.1, -0.2], "position": [-1.0, -50.0, 8.0], "translation": [10.895927751576597, 5.882718243455158, 49.10878113434035]}}]','[[-18.5, 0.0, 0.2], [18.5, 0.0, 0.2]]','{"left": {"moved": null, "drift": {"rotation_deg": 0.0, "position_m": 0.0, "pixels": 0.0}, "drift_since": 1}, "right": {"moved": null, "drift": {"rotation_deg": 0.0, "position_m": 0.0, "pixels": 0.0}, "drift_since": 1}}');
INSERT INTO "revisions" VALUES(2,'everything',2,'2026-11-23 17:55:09.555547','calibrated','01M84RR8Z2WE431B8JGDM3XW8T',NULL,0.2,'[{"id": "left", "image_size": [64, 48], "intrinsics": {"model": "opencv", "matrix": [[60.0, 0.0, 32.0], [0.0, 60.0, 24.0], [0.0, 0.0, 1.0]], "distortion": [], "sigma": null}, "pose": {"rotation": [1.6, 0.1, -0.2], "position": [-0.875, -43.75, 7.0], "translation": [9.533936782629523, 5.147378463023263, 42.970183492547804]}}, {"id": "right", "image_size": [64, 48], "intrinsics": {"model": "opencv", "matrix": [[60.0, 0.0, 32.0], [0.0, 60.0, 24.0], [0.0, 0.0, 1.0]], "distortion": [], "sigma": {"fx": 0.5}}, "pose": {"rotation": [1.6, 0.1, -0.2], "position": [-0.875, -43.75, 7.0], "translation": [9.533936782629523, 5.147378463023263, 42.970183492547804]}}]','[[-18.5, 0.0, 0.2], [18.5, 0.0, 0.2]]','{"left": {"moved": {"rotation_deg": 0.0, "position_m": 6.3307286310503, "pixels": 1.9838683658745555}, "drift": {"rotation_deg": 0.0, "position_m": 6.3307286310503, "pixels": 1.9838683658745555}, "drift_since": 1}, "right": {"moved": {"rotation_deg": 0.0, "position_m": 6.3307286310503, "pixels": 1.9838683658745555}, "drift": {"rotation_deg": 0.0, "position_m": 6.3307286310503, "pixels": 1.9838683658745555}, "drift_since": 1}}');
INSERT INTO "revisions" VALUES(3,'everything',3,'2026-11-23 17:55:10.495668','calibrated','01M84RRA28YNKEM16WFHXG8Q2B',NULL,0.2,'[{"id": "left", "image_size": [64, 48], "intrinsics": {"model": "opencv", "matrix": [[60.0, 0.0, 32.0], [0.0, 60.0, 24.0], [0.0, 0.0, 1.0]], "distortion": [], "sigma": null}, "pose": {"rotation": [1.6, 0.1, -0.2], "position": [-0.765625, -38.28125, 6.125], "translation": [8.342194684800832, 4.503956155145355, 37.59891055597933]}}, {"id": "right", "image_size": [64, 48], "intrinsics": {"model": "opencv", "matrix": [[60.0, 0.0, 32.0], [0.0, 60.0, 24.0], [0.0, 0.0, 1.0]], "distortion": [], "sigma": {"fx": 0.5}}, "pose": {"rotation": [1.6, 0.1, -0.2], "position": [-0.765625, -38.28125, 6.125], "translation": [8.342194684800832, 4.503956155145355, 37.59891055597933]}}]','[[-18.5, 0.0, 0.2], [18.5, 0.0, 0.2]]','{"left": {"moved": {"rotation_deg": 0.0, "position_m": 5.539387552169012, "pixels": 1.8055109552977942}, "drift": {"rotation_deg": 0.0, "position_m": 11.870116183219311, "pixels": 4.179859244701761}, "drift_since": 1}, "right": {"moved": {"rotation_deg": 0.0, "position_m": 5.539387552169012, "pixels": 1.8055109552977942}, "drift": {"rotation_deg": 0.0, "position_m": 11.870116183219311, "pixels": 4.179859244701761}, "drift_since": 1}}');
INSERT INTO "revisions" VALUES(4,'everything',4,'2026-11-23 17:55:10.783288','restored',NULL,1,NULL,'[{"id": "left", "image_size": [64, 48], "intrinsics": {"model": "opencv", "matrix": [[60.0, 0.0, 32.0], [0.0, 60.0, 24.0], [0.0, 0.0, 1.0]], "distortion": [], "sigma": null}, "pose": {"rotation": [1.6, 0.1, -0.2], "position": [-1.0, -50.0, 8.0], "translation": [10.895927751576597, 5.882718243455158, 49.10878113434035]}}, {"id": "right", "image_size": [64, 48], "intrinsics": {"model": "opencv", "matrix": [[60.0, 0.0, 32.0], [0.0, 60.0, 24.0], [0.0, 0.0, 1.0]], "distortion": [], "sigma": {"fx": 0.5}}, "pose": {"rotation": [1.6, 0.1, -0.2], "position": [-1.0, -50.0, 8.0], "translation": [10.895927751576597, 5.882718243455158, 49.10878113434035]}}]','[[-18.5, 0.0, 0.2], [18.5, 0.0, 0.2]]','{"left": {"moved": {"rotation_deg": 0.0, "position_m": 11.870116183219311, "pixels": 2.899763883957856}, "drift": {"rotation_deg": 0.0, "position_m": 0.0, "pixels": 0.0}, "drift_since": 1}, "right": {"moved": {"rotation_deg": 0.0, "position_m": 11.870116183219311, "pixels": 2.899763883957856}, "drift": {"rotation_deg": 0.0, "position_m": 0.0, "pixels": 0.0}, "drift_since": 1}}');
INSERT INTO "revisions" VALUES(5,'rejected',1,'2026-11-23 17:55:10.831335','put',NULL,NULL,NULL,'[{"id": "left", "image_size": [64, 48], "intrinsics": {"model": "opencv", "matrix": [[60.0, 0.0, 32.0], [0.0, 60.0, 24.0], [0.0, 0.0, 1.0]], "distortion": [], "sigma": null}, "pose": {"rotation": [1.6, 0.1, -0.2], "position": [-1.0, -50.0, 8.0], "translation": [10.895927751576597, 5.882718243455158, 49.10878113434035]}}, {"id": "right", "image_size": [64, 48], "intrinsics": {"model": "opencv", "matrix": [[60.0, 0.0, 32.0], [0.0, 60.0, 24.0], [0.0, 0.0, 1.0]], "distortion": [], "sigma": null}, "pose": {"rotation": [1.6, 0.1, -0.2], "position": [-1.0, -50.0, 8.0], "translation": [10.895927751576597, 5.882718243455158, 49.10878113434035]}}]','null','{"left": {"moved": null, "drift": {"rotation_deg": 0.0, "position_m": 0.0, "pixels": 0.0}, "drift_since": 1}, "right": {"moved": null, "drift": {"rotation_deg": 0.0, "position_m": 0.0, "pixels": 0.0}, "drift_since": 1}}');
INSERT INTO "revisions" VALUES(6,'partly',1,'2026-11-23 17:55:11.546915','put',NULL,NULL,NULL,'[{"id": "left", "image_size": [64, 48], "intrinsics": {"model": "opencv", "matrix": [[60.0, 0.0, 32.0], [0.0, 60.0, 24.0], [0.0, 0.0, 1.0]], "distortion": [], "sigma": null}, "pose": {"rotation": [1.6, 0.1, -0.2], "position": [-1.0, -50.0, 8.0], "translation": [10.895927751576597, 5.882718243455158, 49.10878113434035]}}, {"id": "right", "image_size": [64, 48], "intrinsics": {"model": "opencv", "matrix": [[60.0, 0.0, 32.0], [0.0, 60.0, 24.0], [0.0, 0.0, 1.0]], "distortion": [], "sigma": null}, "pose": {"rotation": [1.6, 0.1, -0.2], "position": [-1.0, -50.0, 8.0], "translation": [10.895927751576597, 5.882718243455158, 49.10878113434035]}}]','null','{"left": {"moved": null, "drift": {"rotation_deg": 0.0, "position_m": 0.0, "pixels": 0.0}, "drift_since": 1}, "right": {"moved": null, "drift": {"rotation_deg": 0.0, "position_m": 0.0, "pixels": 0.0}, "drift_since": 1}}');
INSERT INTO "revisions" VALUES(7,'failed',1,'2026-11-23 17:55:12.309282','put',NULL,NULL,NULL,'[{"id": "left", "image_size": [64, 48], "intrinsics": {"model": "opencv", "matrix": [[60.0, 0.0, 32.0], [0.0, 60.0, 24.0], [0.0, 0.0, 1.0]], "distortion": [], "sigma": null}, "pose": {"rotation": [1.6, 0.1, -0.2], "position": [-1.0, -50.0, 8.0], "translation": [10.895927751576597, 5.882718243455158, 49.10878113434035]}}, {"id": "right", "image_size": [64, 48], "intrinsics": {"model": "opencv", "matrix": [[60.0, 0.0, 32.0], [0.0, 60.0, 24.0], [0.0, 0.0, 1.0]], "distortion": [], "sigma": null}, "pose": {"rotation": [1.6, 0.1, -0.2], "position": [-1.0, -50.0, 8.0], "translation": [10.895927751576597, 5.882718243455158, 49.10878113434035]}}]','null','{"left": {"moved": null, "drift": {"rotation_deg": 0.0, "position_m": 0.0, "pixels": 0.0}, "drift_since": 1}, "right": {"moved": null, "drift": {"rotation_deg": 0.0, "position_m": 0.0, "pixels": 0.0}, "drift_since": 1}}');
INSERT INTO "revisions" VALUES(8,'waiting',1,'2026-11-23 17:55:19.615761','put',NULL,NULL,NULL,'[{"id": "left", "image_size": [64, 48], "intrinsics": {"model": "opencv", "matrix": [[60.0, 0.0, 32.0], [0.0, 60.0, 24.0], [0.0, 0.0, 1.0]], "distortion": [], "sigma": null}, "pose": {"rotation": [1.6, 0.1, -0.2], "position": [-1.0, -50.0, 8.0], "translation": [10.895927751576597, 5.882718243455158, 49.10878113434035]}}, {"id": "right", "image_size": [64, 48], "intrinsics": {"model": "opencv", "matrix": [[60.0, 0.0, 32.0], [0.0, 60.0, 24.0], [0.0, 0.0, 1.0]], "distortion": [], "sigma": null}, "pose": {"rotation": [1.6, 0.1, -0.2], "position": [-1.0, -50.0, 8.0], "translation": [10.895927751576597, 5.882718243455158, 49.10878113434035]}}]','null','{"left": {"moved": null, "drift": {"rotation_deg": 0.0, "position_m": 0.0, "pixels": 0.0}, "drift_since": 1}, "right": {"moved": null, "drift": {"rotation_deg": 0.0, "position_m": 0.0, "pixels": 0.0}, "drift_since": 1}}');
INSERT INTO "revisions" VALUES(9,'cancelled',1,'2026-11-23 17:55:20.079016','put',NULL,NULL,NULL,'[{"id": "left", "image_size": [64, 48], "intrinsics": {"model": "opencv", "matrix": [[60.0, 0.0, 32.0], [0.0, 60.0, 24.0], [0.0, 0.0, 1.0]], "distortion": [], "sigma": null}, "pose": {"rotation": [1.6, 0.1, -0.2], "position": [-1.0, -50.0, 8.0], "translation": [10.895927751576597, 5.882718243455158, 49.10878113434035]}}, {"id": "right", "image_size": [64, 48], "intrinsics": {"model": "opencv", "matrix": [[60.0, 0.0, 32.0], [0.0, 60.0, 24.0], [0.0, 0.0, 1.0]], "distortion": [], "sigma": null}, "pose": {"rotation": [1.6, 0.1, -0.2], "position": [-1.0, -50.0, 8.0], "translation": [10.895927751576597, 5.882718243455158, 49.10878113434035]}}]','null','{"left": {"moved": null, "drift": {"rotation_deg": 0.0, "position_m": 0.0, "pixels": 0.0}, "drift_since": 1}, "right": {"moved": null, "drift": {"rotation_deg": 0.0, "position_m": 0.0, "pixels": 0.0}, "drift_since": 1}}');
CREATE TABLE schedules (
	venue VARCHAR(64) NOT NULL, 
	cron VARCHAR(100) NOT NULL, 
	time_zone VARCHAR(64) NOT NULL, 
	exact BOOLEAN NOT NULL, 
	due_at DATETIME NOT NULL, 
	look_at DATETIME NOT NULL, 
	last_at DATETIME, 
	last_job VARCHAR(26), 
	last_error VARCHAR(500), 
	PRIMARY KEY (venue)
);
INSERT INTO "schedules" VALUES('everything','0 3 1 1 *','Europe/Berlin',0,'2027-01-01 02:09:24.000000','2027-01-01 02:09:24.000000',NULL,NULL,NULL);
CREATE TABLE sessions (
	hash VARCHAR(64) NOT NULL, 
	key_hash VARCHAR(64) NOT NULL, 
	expires_at DATETIME NOT NULL, 
	PRIMARY KEY (hash)
);
CREATE TABLE streams (
    workflow_uuid TEXT NOT NULL,
    key TEXT NOT NULL,
    value TEXT NOT NULL,
    "offset" INTEGER NOT NULL, function_id INTEGER NOT NULL DEFAULT 0, "serialization" TEXT DEFAULT NULL,
    PRIMARY KEY (workflow_uuid, key, "offset"),
    FOREIGN KEY (workflow_uuid) REFERENCES workflow_status(workflow_uuid) 
        ON UPDATE CASCADE ON DELETE CASCADE
);
CREATE TABLE tallies (
	metric VARCHAR(64) NOT NULL, 
	labels VARCHAR(255) NOT NULL, 
	value DOUBLE NOT NULL, 
	PRIMARY KEY (metric, labels)
);
INSERT INTO "tallies" VALUES('job_duration_bucket','1',1.0);
INSERT INTO "tallies" VALUES('job_duration_sum','',1.274001);
INSERT INTO "tallies" VALUES('job_restarts','',0.0);
INSERT INTO "tallies" VALUES('job_stage_bucket','decode,0.1',5.0);
INSERT INTO "tallies" VALUES('job_stage_sum','decode',0.5);
INSERT INTO "tallies" VALUES('job_stitch_error_bucket','0.2',4.0);
INSERT INTO "tallies" VALUES('job_stitch_error_sum','',0.8);
INSERT INTO "tallies" VALUES('job_wait_bucket','1',5.0);
INSERT INTO "tallies" VALUES('job_wait_sum','',1.557841);
INSERT INTO "tallies" VALUES('jobs_ended','succeeded,accepted,',2.0);
INSERT INTO "tallies" VALUES('job_duration_bucket','0.25',4.0);
INSERT INTO "tallies" VALUES('jobs_ended','succeeded,rejected,',1.0);
INSERT INTO "tallies" VALUES('jobs_ended','succeeded,partly,',1.0);
INSERT INTO "tallies" VALUES('jobs_ended','failed,,no-markings-in-view',1.0);
INSERT INTO "tallies" VALUES('other_jobs_ended','field,succeeded',1.0);
INSERT INTO "tallies" VALUES('other_jobs_ended','locate,failed',1.0);
INSERT INTO "tallies" VALUES('jobs_ended','cancelled,,',1.0);
CREATE TABLE venue_quality (
	venue VARCHAR(64) NOT NULL, 
	stitch_error_px DOUBLE, 
	moved_px DOUBLE, 
	accepted_at DATETIME, 
	drift_px DOUBLE, 
	rejected_in_a_row INTEGER DEFAULT '0' NOT NULL, 
	cameras JSON, 
	glance JSON, 
	alarm_due_at DATETIME, 
	PRIMARY KEY (venue)
);
INSERT INTO "venue_quality" VALUES('everything',NULL,1.0,'2026-11-23 17:55:10.494849',0.0,0,'{"left": {"accepted_at": "2026-11-23T17:55:10.494849Z", "rejected_in_a_row": 0, "view": null}, "right": {"accepted_at": "2026-11-23T17:55:10.494849Z", "rejected_in_a_row": 0, "view": null}}','{"last": {"status": "succeeded", "finished_at": "2026-11-23T17:55:10.519188Z", "dry_run": false, "verdict": "accepted", "stitch_error_px": 0.2, "moved_px": 1.0}, "errors": [0.2, 0.2], "limit_px": null}',NULL);
INSERT INTO "venue_quality" VALUES('rejected',10.0,1.0,NULL,0.0,1,'{"left": {"accepted_at": null, "rejected_in_a_row": 1, "view": null}, "right": {"accepted_at": null, "rejected_in_a_row": 1, "view": null}}','{"last": {"status": "succeeded", "finished_at": "2026-11-23T17:55:11.489105Z", "dry_run": false, "verdict": "rejected", "stitch_error_px": 0.2, "moved_px": 1.0}, "errors": [0.2], "limit_px": null}',NULL);
INSERT INTO "venue_quality" VALUES('partly',10.0,1.0,NULL,0.0,0,NULL,'{"last": {"status": "succeeded", "finished_at": "2026-11-23T17:55:12.054792Z", "dry_run": true, "verdict": "partly", "stitch_error_px": 0.2, "moved_px": 1.0}, "errors": [0.2], "limit_px": null}',NULL);
INSERT INTO "venue_quality" VALUES('failed',NULL,NULL,NULL,0.0,1,'{"left": {"accepted_at": null, "rejected_in_a_row": 1, "view": null}, "right": {"accepted_at": null, "rejected_in_a_row": 1, "view": null}}','{"last": {"status": "failed", "finished_at": "2026-11-23T17:55:13.055895Z", "dry_run": false, "verdict": null, "stitch_error_px": null, "moved_px": null}, "errors": [], "limit_px": null}',NULL);
INSERT INTO "venue_quality" VALUES('waiting',NULL,NULL,NULL,0.0,0,NULL,NULL,NULL);
INSERT INTO "venue_quality" VALUES('cancelled',NULL,NULL,NULL,0.0,0,NULL,'{"last": {"status": "cancelled", "finished_at": "2026-11-23T17:55:20.160309Z", "dry_run": false, "verdict": null, "stitch_error_px": null, "moved_px": null}, "errors": [], "limit_px": null}',NULL);
CREATE TABLE venues (
	id VARCHAR(64) NOT NULL, 
	document JSON NOT NULL, 
	updated_at DATETIME NOT NULL, 
	PRIMARY KEY (id)
);
INSERT INTO "venues" VALUES('everything','{"id": "everything", "name": "accept", "field": {"template": "football", "length_m": 105.0, "width_m": 68.0, "line_width_m": 0.12, "measures_m": {}, "ridge": [[-18.5, 0.0, 0.2], [18.5, 0.0, 0.2]], "other_markings": []}, "cameras": [{"id": "left", "image_size": [64, 48], "intrinsics": {"model": "opencv", "matrix": [[60.0, 0.0, 32.0], [0.0, 60.0, 24.0], [0.0, 0.0, 1.0]], "distortion": [], "sigma": null}, "pose": {"rotation": [1.6, 0.1, -0.2], "position": [-1.0, -50.0, 8.0], "translation": [10.895927751576597, 5.882718243455158, 49.10878113434035]}, "ignore": [[[0.0, 40.0], [20.0, 40.0], [20.0, 47.0]]], "source": "http://***@example.com/a.jpg"}, {"id": "right", "image_size": [64, 48], "intrinsics": {"model": "opencv", "matrix": [[60.0, 0.0, 32.0], [0.0, 60.0, 24.0], [0.0, 0.0, 1.0]], "distortion": [], "sigma": {"fx": 0.5}}, "pose": {"rotation": [1.6, 0.1, -0.2], "position": [-1.0, -50.0, 8.0], "translation": [10.895927751576597, 5.882718243455158, 49.10878113434035]}, "ignore": [], "source": "http://example.com/b.jpg"}], "accept": "all", "lens": "may-drift", "alarms": {"moved_since_last_px": null, "moved_since_first_px": 40.0, "rejected_in_a_row": 1, "not_calibrated_for_h": null, "callback_url": "https://example.com/alarms"}, "schedule": {"cron": "0 3 1 1 *", "time_zone": "Europe/Berlin", "exact": false, "options": {"priority": "routine", "timeout_s": null, "callback_url": null, "preset": "esc", "search": "auto", "seed": 3, "generations": 100, "parents": 64, "offspring": 128, "stitch_weight": 0.5, "flat": false, "fit_focal_length": false, "fit_ridge": false, "dry_run": false, "pictures": false}}, "webhooks": [{"url": "https://example.com/told", "events": ["poses.changed", "venue.*"]}]}','2026-11-23 17:55:10.782666');
INSERT INTO "venues" VALUES('rejected','{"id": "rejected", "name": "reject", "field": {"template": "football", "length_m": 105.0, "width_m": 68.0, "line_width_m": 0.12, "measures_m": {}, "ridge": null, "other_markings": []}, "cameras": [{"id": "left", "image_size": [64, 48], "intrinsics": {"model": "opencv", "matrix": [[60.0, 0.0, 32.0], [0.0, 60.0, 24.0], [0.0, 0.0, 1.0]], "distortion": [], "sigma": null}, "pose": {"rotation": [1.6, 0.1, -0.2], "position": [-1.0, -50.0, 8.0], "translation": [10.895927751576597, 5.882718243455158, 49.10878113434035]}, "ignore": [], "source": null}, {"id": "right", "image_size": [64, 48], "intrinsics": {"model": "opencv", "matrix": [[60.0, 0.0, 32.0], [0.0, 60.0, 24.0], [0.0, 0.0, 1.0]], "distortion": [], "sigma": null}, "pose": {"rotation": [1.6, 0.1, -0.2], "position": [-1.0, -50.0, 8.0], "translation": [10.895927751576597, 5.882718243455158, 49.10878113434035]}, "ignore": [], "source": null}], "accept": "each", "lens": "fixed", "alarms": null, "schedule": null, "webhooks": []}','2026-11-23 17:55:10.830524');
INSERT INTO "venues" VALUES('partly','{"id": "partly", "name": "partly", "field": {"template": "football", "length_m": 105.0, "width_m": 68.0, "line_width_m": 0.12, "measures_m": {}, "ridge": null, "other_markings": []}, "cameras": [{"id": "left", "image_size": [64, 48], "intrinsics": {"model": "opencv", "matrix": [[60.0, 0.0, 32.0], [0.0, 60.0, 24.0], [0.0, 0.0, 1.0]], "distortion": [], "sigma": null}, "pose": {"rotation": [1.6, 0.1, -0.2], "position": [-1.0, -50.0, 8.0], "translation": [10.895927751576597, 5.882718243455158, 49.10878113434035]}, "ignore": [], "source": null}, {"id": "right", "image_size": [64, 48], "intrinsics": {"model": "opencv", "matrix": [[60.0, 0.0, 32.0], [0.0, 60.0, 24.0], [0.0, 0.0, 1.0]], "distortion": [], "sigma": null}, "pose": {"rotation": [1.6, 0.1, -0.2], "position": [-1.0, -50.0, 8.0], "translation": [10.895927751576597, 5.882718243455158, 49.10878113434035]}, "ignore": [], "source": null}], "accept": "each", "lens": "fixed", "alarms": null, "schedule": null, "webhooks": []}','2026-11-23 17:55:11.546066');
INSERT INTO "venues" VALUES('failed','{"id": "failed", "name": "fail", "field": {"template": "football", "length_m": 105.0, "width_m": 68.0, "line_width_m": 0.12, "measures_m": {}, "ridge": null, "other_markings": []}, "cameras": [{"id": "left", "image_size": [64, 48], "intrinsics": {"model": "opencv", "matrix": [[60.0, 0.0, 32.0], [0.0, 60.0, 24.0], [0.0, 0.0, 1.0]], "distortion": [], "sigma": null}, "pose": {"rotation": [1.6, 0.1, -0.2], "position": [-1.0, -50.0, 8.0], "translation": [10.895927751576597, 5.882718243455158, 49.10878113434035]}, "ignore": [], "source": null}, {"id": "right", "image_size": [64, 48], "intrinsics": {"model": "opencv", "matrix": [[60.0, 0.0, 32.0], [0.0, 60.0, 24.0], [0.0, 0.0, 1.0]], "distortion": [], "sigma": null}, "pose": {"rotation": [1.6, 0.1, -0.2], "position": [-1.0, -50.0, 8.0], "translation": [10.895927751576597, 5.882718243455158, 49.10878113434035]}, "ignore": [], "source": null}], "accept": "each", "lens": "fixed", "alarms": null, "schedule": null, "webhooks": []}','2026-11-23 17:55:12.299995');
INSERT INTO "venues" VALUES('waiting','{"id": "waiting", "name": "accept", "field": {"template": "football", "length_m": 105.0, "width_m": 68.0, "line_width_m": 0.12, "measures_m": {}, "ridge": null, "other_markings": []}, "cameras": [{"id": "left", "image_size": [64, 48], "intrinsics": {"model": "opencv", "matrix": [[60.0, 0.0, 32.0], [0.0, 60.0, 24.0], [0.0, 0.0, 1.0]], "distortion": [], "sigma": null}, "pose": {"rotation": [1.6, 0.1, -0.2], "position": [-1.0, -50.0, 8.0], "translation": [10.895927751576597, 5.882718243455158, 49.10878113434035]}, "ignore": [], "source": null}, {"id": "right", "image_size": [64, 48], "intrinsics": {"model": "opencv", "matrix": [[60.0, 0.0, 32.0], [0.0, 60.0, 24.0], [0.0, 0.0, 1.0]], "distortion": [], "sigma": null}, "pose": {"rotation": [1.6, 0.1, -0.2], "position": [-1.0, -50.0, 8.0], "translation": [10.895927751576597, 5.882718243455158, 49.10878113434035]}, "ignore": [], "source": null}], "accept": "each", "lens": "fixed", "alarms": null, "schedule": null, "webhooks": []}','2026-11-23 17:55:19.595287');
INSERT INTO "venues" VALUES('cancelled','{"id": "cancelled", "name": "accept", "field": {"template": "football", "length_m": 105.0, "width_m": 68.0, "line_width_m": 0.12, "measures_m": {}, "ridge": null, "other_markings": []}, "cameras": [{"id": "left", "image_size": [64, 48], "intrinsics": {"model": "opencv", "matrix": [[60.0, 0.0, 32.0], [0.0, 60.0, 24.0], [0.0, 0.0, 1.0]], "distortion": [], "sigma": null}, "pose": {"rotation": [1.6, 0.1, -0.2], "position": [-1.0, -50.0, 8.0], "translation": [10.895927751576597, 5.882718243455158, 49.10878113434035]}, "ignore": [], "source": null}, {"id": "right", "image_size": [64, 48], "intrinsics": {"model": "opencv", "matrix": [[60.0, 0.0, 32.0], [0.0, 60.0, 24.0], [0.0, 0.0, 1.0]], "distortion": [], "sigma": null}, "pose": {"rotation": [1.6, 0.1, -0.2], "position": [-1.0, -50.0, 8.0], "translation": [10.895927751576597, 5.882718243455158, 49.10878113434035]}, "ignore": [], "source": null}], "accept": "each", "lens": "fixed", "alarms": null, "schedule": null, "webhooks": []}','2026-11-23 17:55:20.078121');
CREATE TABLE workers (
	name VARCHAR(255) NOT NULL, 
	model_sha256 VARCHAR(64), 
	started_at DATETIME NOT NULL, 
	seen_at DATETIME NOT NULL, 
	PRIMARY KEY (name)
);
INSERT INTO "workers" VALUES('vm','2f782beca6c497e09ee1b67bd6a1202048f19e97f7e1364a58d415ce7b3ecd9e','2026-11-23 17:55:07.702131','2026-11-23 17:55:13.916331');
CREATE TABLE workflow_events (
    workflow_uuid TEXT NOT NULL,
    key TEXT NOT NULL,
    value TEXT NOT NULL, "serialization" TEXT DEFAULT NULL,
    PRIMARY KEY (workflow_uuid, key),
    FOREIGN KEY (workflow_uuid) REFERENCES workflow_status(workflow_uuid) 
        ON UPDATE CASCADE ON DELETE CASCADE
);
CREATE TABLE workflow_events_history (
    workflow_uuid TEXT NOT NULL,
    function_id INTEGER NOT NULL,
    key TEXT NOT NULL,
    value TEXT NOT NULL, "serialization" TEXT DEFAULT NULL,
    PRIMARY KEY (workflow_uuid, function_id, key),
    FOREIGN KEY (workflow_uuid) REFERENCES workflow_status(workflow_uuid)
        ON UPDATE CASCADE ON DELETE CASCADE
);
CREATE TABLE workflow_input (
    workflow_uuid TEXT NOT NULL PRIMARY KEY,
    inputs TEXT,
    retention_timestamp INTEGER NOT NULL DEFAULT (strftime('%s','now') * 1000)
);
INSERT INTO "workflow_input" VALUES('01M84RR8Z2WE431B8JGDM3XW8T','gASVNgAAAAAAAAB9lCiMBGFyZ3OUjBowMU04NFJSOFoyV0U0MzFCOEpHRE0zWFc4VJSFlIwGa3dhcmdzlH2UdS4=',1795456508000);
INSERT INTO "workflow_input" VALUES('01M84RRA28YNKEM16WFHXG8Q2B','gASVNgAAAAAAAAB9lCiMBGFyZ3OUjBowMU04NFJSQTI4WU5LRU0xNldGSFhHOFEyQpSFlIwGa3dhcmdzlH2UdS4=',1795456510000);
INSERT INTO "workflow_input" VALUES('01M84RRB0MEHG5FGJTH98BA0GH','gASVNgAAAAAAAAB9lCiMBGFyZ3OUjBowMU04NFJSQjBNRUhHNUZHSlRIOThCQTBHSJSFlIwGa3dhcmdzlH2UdS4=',1795456511000);
INSERT INTO "workflow_input" VALUES('01M84RRBKB5X4XSHAKR0R0X63P','gASVNgAAAAAAAAB9lCiMBGFyZ3OUjBowMU04NFJSQktCNVg0WFNIQUtSMFIwWDYzUJSFlIwGa3dhcmdzlH2UdS4=',1795456511000);
INSERT INTO "workflow_input" VALUES('01M84RRCB2WV2NT6Z39NW5F7XA','gASVNgAAAAAAAAB9lCiMBGFyZ3OUjBowMU04NFJSQ0IyV1YyTlQ2WjM5Tlc1RjdYQZSFlIwGa3dhcmdzlH2UdS4=',1795456512000);
INSERT INTO "workflow_input" VALUES('01M84RRD9A7PT2JF5M6ZDVR5DA','gASVNgAAAAAAAAB9lCiMBGFyZ3OUjBowMU04NFJSRDlBN1BUMkpGNU02WkRWUjVEQZSFlIwGa3dhcmdzlH2UdS4=',1795456513000);
INSERT INTO "workflow_input" VALUES('01M84RRE96HZVVDZAF2X24AQ3C','gASVNgAAAAAAAAB9lCiMBGFyZ3OUjBowMU04NFJSRTk2SFpWVkRaQUYyWDI0QVEzQ5SFlIwGa3dhcmdzlH2UdS4=',1795456514000);
INSERT INTO "workflow_input" VALUES('01M84RRKQK6NPNZ4VY5NN1VA42','gASVNgAAAAAAAAB9lCiMBGFyZ3OUjBowMU04NFJSS1FLNk5QTlo0Vlk1Tk4xVkE0MpSFlIwGa3dhcmdzlH2UdS4=',1795456520000);
INSERT INTO "workflow_input" VALUES('01M84RRKXA4W8G4EWGR8BBKEKX','gASVNgAAAAAAAAB9lCiMBGFyZ3OUjBowMU04NFJSS1hBNFc4RzRFV0dSOEJCS0VLWJSFlIwGa3dhcmdzlH2UdS4=',1795456520000);
CREATE TABLE workflow_output (
    workflow_uuid TEXT NOT NULL PRIMARY KEY,
    output TEXT,
    error TEXT,
    retention_timestamp INTEGER NOT NULL DEFAULT (strftime('%s','now') * 1000)
);
INSERT INTO "workflow_output" VALUES('01M84RR8Z2WE431B8JGDM3XW8T','gAROLg==',NULL,1795456509000);
INSERT INTO "workflow_output" VALUES('01M84RRA28YNKEM16WFHXG8Q2B','gAROLg==',NULL,1795456510000);
INSERT INTO "workflow_output" VALUES('01M84RRB0MEHG5FGJTH98BA0GH','gAROLg==',NULL,1795456511000);
INSERT INTO "workflow_output" VALUES('01M84RRBKB5X4XSHAKR0R0X63P','gAROLg==',NULL,1795456512000);
INSERT INTO "workflow_output" VALUES('01M84RRCB2WV2NT6Z39NW5F7XA','gAROLg==',NULL,1795456513000);
INSERT INTO "workflow_output" VALUES('01M84RRD9A7PT2JF5M6ZDVR5DA','gAROLg==',NULL,1795456514000);
INSERT INTO "workflow_output" VALUES('01M84RRE96HZVVDZAF2X24AQ3C','gAROLg==',NULL,1795456514000);
CREATE TABLE workflow_schedules (
    schedule_id TEXT PRIMARY KEY,
    schedule_name TEXT NOT NULL UNIQUE,
    workflow_name TEXT NOT NULL,
    workflow_class_name TEXT,
    schedule TEXT NOT NULL,
    status TEXT NOT NULL DEFAULT 'ACTIVE',
    context TEXT NOT NULL
, "last_fired_at" TEXT DEFAULT NULL, "automatic_backfill" BOOLEAN NOT NULL DEFAULT FALSE, "cron_timezone" TEXT DEFAULT NULL, "queue_name" TEXT DEFAULT NULL, "application_name" TEXT DEFAULT NULL);
CREATE TABLE workflow_status (
    workflow_uuid TEXT PRIMARY KEY,
    status TEXT,
    name TEXT,
    authenticated_user TEXT,
    assumed_role TEXT,
    authenticated_roles TEXT,
    request TEXT,
    output TEXT,
    error TEXT,
    executor_id TEXT,
    created_at INTEGER NOT NULL DEFAULT (strftime('%s','now') * 1000),
    updated_at INTEGER NOT NULL DEFAULT (strftime('%s','now') * 1000),
    application_version TEXT,
    application_id TEXT,
    class_name TEXT DEFAULT NULL,
    config_name TEXT DEFAULT NULL,
    recovery_attempts INTEGER DEFAULT 0,
    queue_name TEXT,
    workflow_timeout_ms INTEGER,
    workflow_deadline_epoch_ms INTEGER,
    inputs TEXT,
    started_at_epoch_ms INTEGER,
    deduplication_id TEXT,
    priority INTEGER NOT NULL DEFAULT 0
, queue_partition_key TEXT, forked_from TEXT, "owner_xid" TEXT DEFAULT NULL, "parent_workflow_id" TEXT DEFAULT NULL, "serialization" TEXT DEFAULT NULL, "delay_until_epoch_ms" BIGINT DEFAULT NULL, "was_forked_from" BOOLEAN NOT NULL DEFAULT FALSE, "rate_limited" BOOLEAN NOT NULL DEFAULT FALSE, "completed_at" BIGINT, "attributes" TEXT, "schedule_name" TEXT, "debounce_deadline_epoch_ms" BIGINT DEFAULT NULL, "is_debounced" BOOLEAN NOT NULL DEFAULT FALSE, "application_name" TEXT DEFAULT NULL, "creator_xid" TEXT DEFAULT NULL);
INSERT INTO "workflow_status" VALUES('01M84RR8Z2WE431B8JGDM3XW8T','SUCCESS','calibrate',NULL,NULL,NULL,NULL,NULL,NULL,'vm',1795456508000,1795456509000,'1',NULL,NULL,NULL,1,'calibration',NULL,NULL,NULL,1795456509000,NULL,100,NULL,NULL,NULL,NULL,'py_pickle',NULL,0,0,1795456509000,'null',NULL,NULL,0,'esc','7d7f9c63-1e34-4458-9d69-720a92ba5bb9');
INSERT INTO "workflow_status" VALUES('01M84RRA28YNKEM16WFHXG8Q2B','SUCCESS','calibrate',NULL,NULL,NULL,NULL,NULL,NULL,'vm',1795456510000,1795456510000,'1',NULL,NULL,NULL,1,'calibration',NULL,NULL,NULL,1795456510000,NULL,100,NULL,NULL,NULL,NULL,'py_pickle',NULL,0,0,1795456510000,'null',NULL,NULL,0,'esc','24e64c9d-1068-4293-9e2b-e85eb60dfd52');
INSERT INTO "workflow_status" VALUES('01M84RRB0MEHG5FGJTH98BA0GH','SUCCESS','calibrate',NULL,NULL,NULL,NULL,NULL,NULL,'vm',1795456511000,1795456511000,'1',NULL,NULL,NULL,1,'calibration',NULL,NULL,NULL,1795456511000,NULL,100,NULL,NULL,NULL,NULL,'py_pickle',NULL,0,0,1795456511000,'null',NULL,NULL,0,'esc','d74980eb-39e9-47db-806b-ed50cb39b9e8');
INSERT INTO "workflow_status" VALUES('01M84RRBKB5X4XSHAKR0R0X63P','SUCCESS','calibrate',NULL,NULL,NULL,NULL,NULL,NULL,'vm',1795456511000,1795456512000,'1',NULL,NULL,NULL,1,'calibration',NULL,NULL,NULL,1795456511000,NULL,100,NULL,NULL,NULL,NULL,'py_pickle',NULL,0,0,1795456512000,'null',NULL,NULL,0,'esc','a644c6ae-6d48-4c76-bba6-6a12f50ba66d');
INSERT INTO "workflow_status" VALUES('01M84RRCB2WV2NT6Z39NW5F7XA','SUCCESS','calibrate',NULL,NULL,NULL,NULL,NULL,NULL,'vm',1795456512000,1795456513000,'1',NULL,NULL,NULL,1,'calibration',NULL,NULL,NULL,1795456512000,NULL,100,NULL,NULL,NULL,NULL,'py_pickle',NULL,0,0,1795456513000,'null',NULL,NULL,0,'esc','71928c00-78b0-47c9-bc25-e7a7766f2dc1');
INSERT INTO "workflow_status" VALUES('01M84RRD9A7PT2JF5M6ZDVR5DA','SUCCESS','calibrate',NULL,NULL,NULL,NULL,NULL,NULL,'vm',1795456513000,1795456514000,'1',NULL,NULL,NULL,1,'calibration',NULL,NULL,NULL,1795456513000,NULL,100,NULL,NULL,NULL,NULL,'py_pickle',NULL,0,0,1795456514000,'null',NULL,NULL,0,'esc','c8617fd5-00ad-4e54-baed-5bf4093df891');
INSERT INTO "workflow_status" VALUES('01M84RRE96HZVVDZAF2X24AQ3C','SUCCESS','calibrate',NULL,NULL,NULL,NULL,NULL,NULL,'vm',1795456514000,1795456514000,'1',NULL,NULL,NULL,1,'light',NULL,NULL,NULL,1795456514000,NULL,100,NULL,NULL,NULL,NULL,'py_pickle',NULL,0,0,1795456514000,'null',NULL,NULL,0,'esc','4d460b45-60e4-4e78-a35f-ccdb503b1a44');
INSERT INTO "workflow_status" VALUES('01M84RRKQK6NPNZ4VY5NN1VA42','ENQUEUED','calibrate',NULL,NULL,NULL,NULL,NULL,NULL,NULL,1795456520000,1795456520000,NULL,NULL,NULL,NULL,0,'calibration',NULL,NULL,NULL,NULL,NULL,100,NULL,NULL,NULL,NULL,'py_pickle',NULL,0,0,NULL,'null',NULL,NULL,0,'esc','cef7e067-5cd3-4737-bca4-5e42a873c84d');
INSERT INTO "workflow_status" VALUES('01M84RRKXA4W8G4EWGR8BBKEKX','ENQUEUED','calibrate',NULL,NULL,NULL,NULL,NULL,NULL,NULL,1795456520000,1795456520000,NULL,NULL,NULL,NULL,0,'calibration',NULL,NULL,NULL,NULL,NULL,100,NULL,NULL,NULL,NULL,'py_pickle',NULL,0,0,NULL,'null',NULL,NULL,0,'esc','f9fdabba-ac77-4087-b528-b538bda27cc5');
CREATE UNIQUE INDEX revisions_by_venue ON revisions (venue, number);
CREATE INDEX revisions_by_job ON revisions (job);
CREATE INDEX revisions_by_time ON revisions (cause, at);
CREATE INDEX jobs_by_venue ON jobs (venue, id, status, kind);
CREATE INDEX jobs_of_status ON jobs (status, id);
CREATE INDEX jobs_of_kind ON jobs (kind, id);
CREATE INDEX jobs_of_kind_and_status ON jobs (kind, status, id);
CREATE INDEX jobs_by_status ON jobs (status, priority, id);
CREATE INDEX jobs_by_end ON jobs (finished_at);
CREATE UNIQUE INDEX one_job_per_key ON jobs (venue, idempotency_key);
CREATE UNIQUE INDEX one_active_job_per_venue ON jobs (venue) WHERE status IN ('queued', 'running') AND kind = 'calibration';
CREATE INDEX jobs_with_frames ON jobs (finished_at) WHERE frames_deleted_at IS NULL;
CREATE INDEX jobs_with_pictures ON jobs (finished_at) WHERE pictures_deleted_at IS NULL;
CREATE INDEX venues_by_stitch_error ON venue_quality (stitch_error_px);
CREATE INDEX venues_by_alarm ON venue_quality (alarm_due_at);
CREATE INDEX alarms_by_since ON alarms (since);
CREATE INDEX schedules_by_look ON schedules (look_at);
CREATE INDEX leftovers_by_due ON leftovers (due_at);
CREATE INDEX events_by_venue ON events (venue, id);
CREATE INDEX deliveries_by_due ON deliveries (status, due_at);
CREATE UNIQUE INDEX api_keys_by_hash ON api_keys (hash);
CREATE INDEX workflow_status_created_at_index ON workflow_status (created_at);
CREATE INDEX idx_workflow_topic ON notifications (destination_uuid, topic);
CREATE INDEX "idx_workflow_status_delayed" ON "workflow_status" ("delay_until_epoch_ms") WHERE status = 'DELAYED';
CREATE INDEX "idx_workflow_status_forked_from" ON "workflow_status" ("forked_from") WHERE "forked_from" IS NOT NULL;
CREATE INDEX "idx_workflow_status_parent_workflow_id" ON "workflow_status" ("parent_workflow_id") WHERE "parent_workflow_id" IS NOT NULL;
CREATE UNIQUE INDEX "uq_workflow_status_dedup_id" ON "workflow_status" ("queue_name", "deduplication_id") WHERE "deduplication_id" IS NOT NULL;
CREATE INDEX "idx_workflow_status_pending" ON "workflow_status" ("created_at") WHERE "status" = 'PENDING';
CREATE INDEX "idx_workflow_status_failed" ON "workflow_status" ("status", "created_at") WHERE "status" IN ('ERROR', 'CANCELLED', 'MAX_RECOVERY_ATTEMPTS_EXCEEDED');
CREATE INDEX "idx_workflow_status_rate_limited" ON "workflow_status" ("queue_name", "started_at_epoch_ms") WHERE "rate_limited" = TRUE;
CREATE INDEX "idx_workflow_status_completed_at" ON "workflow_status" ("completed_at") WHERE "completed_at" IS NOT NULL;
CREATE INDEX "idx_workflow_status_started_at" ON "workflow_status" ("started_at_epoch_ms") WHERE "started_at_epoch_ms" IS NOT NULL;
CREATE INDEX "idx_workflow_status_schedule_name" ON "workflow_status" ("schedule_name") WHERE "schedule_name" IS NOT NULL;
CREATE UNIQUE INDEX "uq_application_versions_owner_version"
    ON application_versions ("application_name", "version_name")
    WHERE "application_name" IS NOT NULL;
CREATE UNIQUE INDEX "uq_application_versions_unclaimed_version"
    ON application_versions ("version_name")
    WHERE "application_name" IS NULL;
CREATE INDEX idx_workflow_input_retention
    ON workflow_input (retention_timestamp);
CREATE INDEX idx_workflow_output_retention
    ON workflow_output (retention_timestamp);
CREATE INDEX idx_operation_outputs_retention
    ON operation_outputs (retention_timestamp);
CREATE INDEX "idx_workflow_status_in_flight_v2" ON "workflow_status" ("queue_name", "status", "priority", "created_at", "application_name") WHERE "status" IN ('ENQUEUED', 'PENDING');
CREATE INDEX "idx_workflow_status_partition_dequeue_v3" ON "workflow_status" ("queue_name", "status", "queue_partition_key", "priority", "created_at", "workflow_uuid", "application_name") WHERE "status" IN ('ENQUEUED', 'PENDING') AND "queue_partition_key" IS NOT NULL;
CREATE INDEX "idx_operation_outputs_completed_at_function_name_v2" ON "operation_outputs" ("completed_at_epoch_ms", "function_name", "application_name");
CREATE INDEX "idx_workflow_status_deadline" ON "workflow_status" ("workflow_deadline_epoch_ms") WHERE "status" IN ('ENQUEUED', 'PENDING', 'DELAYED') AND "workflow_deadline_epoch_ms" IS NOT NULL;
CREATE INDEX "idx_application_versions_timestamp" ON "application_versions" ("version_timestamp" DESC);
CREATE INDEX "idx_application_versions_owner_timestamp" ON "application_versions" ("application_name", "version_timestamp" DESC);
DELETE FROM "sqlite_sequence";
INSERT INTO "sqlite_sequence" VALUES('events',32);
COMMIT;
