"""Between socket and route: protocol limits, access control, time-outs, worker threads."""
