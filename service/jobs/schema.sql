CREATE TABLE IF NOT EXISTS jobs (
    number INTEGER PRIMARY KEY AUTOINCREMENT, id TEXT NOT NULL UNIQUE, kind TEXT NOT NULL, settings TEXT NOT NULL,
    model TEXT, media_type TEXT NOT NULL, filename TEXT NOT NULL,
    status TEXT NOT NULL DEFAULT 'queued', progress REAL NOT NULL DEFAULT 0, message TEXT NOT NULL DEFAULT 'waiting',
    attempts INTEGER NOT NULL DEFAULT 0, created REAL NOT NULL, started REAL, ended REAL,
    error TEXT, result TEXT, size INTEGER, idempotency TEXT UNIQUE,
    owner TEXT NOT NULL DEFAULT ''
);
CREATE INDEX IF NOT EXISTS jobs_by_status ON jobs (status, number);
CREATE INDEX IF NOT EXISTS jobs_by_result ON jobs (result);
CREATE TABLE IF NOT EXISTS inputs (
    job TEXT NOT NULL REFERENCES jobs (id) ON DELETE CASCADE, name TEXT NOT NULL, sha TEXT NOT NULL
);
CREATE INDEX IF NOT EXISTS inputs_by_job ON inputs (job);
CREATE INDEX IF NOT EXISTS inputs_by_sha ON inputs (sha);
