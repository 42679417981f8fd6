"""What the OpenAPI says of all paths alike: that they want a key, where the service has some."""

from typing import Any

from fastapi import FastAPI

from service.middleware import FREE

_SCHEMES = {
    "bearer": {"type": "http", "scheme": "bearer", "description": "Authorization: Bearer <key>."},
    "header": {"type": "apiKey", "in": "header", "name": "X-API-Key"},
    "basic": {"type": "http", "scheme": "basic", "description": "Any user name; the key is the password."},
}


def ask_for_keys(app: FastAPI) -> None:
    """Say in the OpenAPI of `app` how a key is sent, and which paths want one.

    Args:
        app: whose routes are complete when the OpenAPI is first asked for.
    """
    made = app.openapi

    def openapi() -> dict[str, Any]:
        described = made()
        described.setdefault("components", {})["securitySchemes"] = _SCHEMES
        for path, operations in described["paths"].items():
            if not path.startswith(FREE):
                for operation in operations.values():
                    operation["security"] = [{name: []} for name in _SCHEMES]
        return described

    app.openapi = openapi  # type: ignore[method-assign]
