"""Jobs: long-running work, and reading of untrusted files, each in a separate process.

    upload → file_store (content-addressed files) ┐
    request → store (SQLite) → supervisor → process (limits, killable) → result in file_store, model in models/

Everything is in one data folder. After a crash, `store` knows the queued and running jobs, and the next supervisor
restarts them.
"""
