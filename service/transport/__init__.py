"""Between server and route: access control, time-outs, compression, worker threads."""
