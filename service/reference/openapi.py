"""Security schemes in the OpenAPI document of a service with keys."""

from typing import Any

from fastapi import FastAPI

from service.transport.access import FREE

_SCHEMES = {
    "bearer": {"type": "http", "scheme": "bearer", "description": "Authorization: Bearer <key>."},
    "header": {"type": "apiKey", "in": "header", "name": "X-API-Key"},
    "basic": {"type": "http", "scheme": "basic", "description": "Any user name; the key is the password."},
}


def require_keys(app: FastAPI) -> None:
    """Describe in the OpenAPI of `app`, whose routes are complete, how keys are sent and which paths need one."""
    generate = app.openapi

    def openapi() -> dict[str, Any]:
        described = generate()
        described.setdefault("components", {})["securitySchemes"] = _SCHEMES
        for path, operations in described["paths"].items():
            if not path.startswith(FREE):
                for operation in operations.values():
                    operation["security"] = [{name: []} for name in _SCHEMES]
        return described

    app.openapi = openapi  # type: ignore[method-assign]
