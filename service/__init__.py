"""motionenv over HTTP: `create_app(settings)` in `service.app`, started by `motionenv serve`.

request → middleware (id, log, metrics, host, key, rate, size) → routes/ → motionenv → formats/ → response
                                                                          → jobs/ (a process each) → files
"""
