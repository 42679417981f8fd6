"""A service of several machines: jobs in PostgreSQL, files in an object store, `motionenv work` where jobs run.

    motionenv serve (any number) → PostgreSQL: jobs, models, counts; procrastinate's queue ┐
                                 → store: files by content (S3, a shared folder)           ├ motionenv work (any number)

A job is claimed with a lease that its worker renews. A worker that falls silent loses its jobs when their leases end:
whichever worker notices first queues them again, and what the silent one still says of them counts no more.
"""
