"""Work that takes minutes, or reads files that nobody vouches for: each job in a process of its own.

    upload → blobs (content-addressed files) ┐
    request → store (SQLite) → supervisor → process (limits, killable) → result as a blob, model in models/

All of it lies in one data folder. Whatever is killed in the middle, `store` knows what waits and what ran, and the next
supervisor begins that again.
"""
