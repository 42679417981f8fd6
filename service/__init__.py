"""motionenv over HTTP: `create_app(settings)` in `service.app`, started by `motionenv serve`.

request → protocol → middleware (host, id, log, metrics, key, rate, size) → routes/ → motionenv → formats/ → response
                                                                    → jobs/ (a process each) → files
"""
