CREATE TABLE IF NOT EXISTS motionenv_jobs (
    number bigint GENERATED ALWAYS AS IDENTITY PRIMARY KEY, id text NOT NULL UNIQUE, kind text NOT NULL,
    lane text NOT NULL, settings json NOT NULL, model text, media_type text NOT NULL, filename text NOT NULL,
    status text NOT NULL DEFAULT 'queued', progress double precision NOT NULL DEFAULT 0,
    message text NOT NULL DEFAULT 'waiting', attempts integer NOT NULL DEFAULT 0,
    created double precision NOT NULL, started double precision, ended double precision,
    error json, result text, size bigint, idempotency text UNIQUE, owner text NOT NULL DEFAULT '',
    lease text, leased_until timestamptz, ticket bigint
);
CREATE INDEX IF NOT EXISTS motionenv_jobs_by_status ON motionenv_jobs (status, lane);
CREATE INDEX IF NOT EXISTS motionenv_jobs_by_result ON motionenv_jobs (result);
CREATE TABLE IF NOT EXISTS motionenv_inputs (
    job text NOT NULL REFERENCES motionenv_jobs (id) ON DELETE CASCADE, place integer NOT NULL, name text NOT NULL,
    sha text NOT NULL, PRIMARY KEY (job, place)
);
CREATE INDEX IF NOT EXISTS motionenv_inputs_by_sha ON motionenv_inputs (sha);
CREATE TABLE IF NOT EXISTS motionenv_models (
    name text PRIMARY KEY, owner text NOT NULL, sha text NOT NULL, changed bigint NOT NULL
);
CREATE TABLE IF NOT EXISTS motionenv_processes (
    id text PRIMARY KEY, streams integer NOT NULL, seen timestamptz NOT NULL
);
CREATE UNLOGGED TABLE IF NOT EXISTS motionenv_counts (
    key text PRIMARY KEY, value bigint NOT NULL, expires timestamptz NOT NULL
);
