"""Describes the HTTP interface (OpenAPI 3.1), made from the types of the contract."""

from __future__ import annotations

from typing import Any

from monitor import __version__
from monitor.web.access import ANSWERING_WITHOUT_FILE, FILES, address_of, offered, role_needed, taken_fields
from monitor.web.parcel import MEDIA_TYPE
from monitor.web.schemas import Schemas
from monitor.workflow.contract import QUESTIONS

_REFUSALS = {
    "400": "the request is wrong; the sentence says what would be right",
    "401": "no token, or one that nobody has",
    "403": "the user's role may not ask this",
    "404": "there is no such thing in the database; the sentence names what there is",
    "413": "the body is too large",
    "422": "the folder, the reading or the result was refused, with every fault",
}


def openapi() -> dict[str, Any]:
    """Return the description of the interface, made from the types of the contract."""
    schemas = Schemas()
    paths = {address_of(name): {"post": _operation(name, schemas)} for name in offered()}
    return {
        "openapi": "3.1.0",
        "info": {"title": "machine-health-monitor", "version": __version__},
        "paths": paths,
        "components": {
            "schemas": {
                **schemas.definitions,
                "Refusal": {
                    "type": "object",
                    "properties": {
                        "error": {"type": "string"},
                        "faults": {"type": "array", "items": {"type": "string"}},
                        "in_full": {"type": "string"},
                    },
                    "required": ["error"],
                },
            },
            "securitySchemes": {"token": {"type": "http", "scheme": "bearer"}},
        },
        "security": [{}, {"token": []}],
    }


def _operation(question: str, schemas: Schemas) -> dict[str, Any]:
    asked, travelling = QUESTIONS[question], FILES.get(question)
    taken = taken_fields(question)
    document = (
        {"type": "object", "additionalProperties": False}
        if asked.request is None
        else schemas.request(asked.request, taken)
    )
    body: dict[str, Any] = {"application/json": {"schema": document}}
    if travelling is not None and travelling.upload is not None:
        parts = {
            "file": {"type": "array", "items": {"type": "string", "format": "binary"}},
            "document": document,
        }
        body = {
            "multipart/form-data": {"schema": {"type": "object", "properties": parts, "required": ["file"]}}
        }
    content: dict[str, Any] = {"application/json": {"schema": schemas.of(asked.answer)}}
    if travelling is not None and travelling.download is not None:
        content["application/octet-stream"] = {"schema": {"type": "string", "format": "binary"}}
        if question not in ANSWERING_WITHOUT_FILE:
            del content["application/json"]
    if travelling is not None:
        parcel = {"type": "string", "format": "binary", "description": "request.json, and files by field"}
        body[MEDIA_TYPE] = {"schema": parcel}
        content[MEDIA_TYPE] = {"schema": parcel | {"description": "answer.json, and files by field"}}
    refusal = {"application/json": {"schema": {"$ref": "#/components/schemas/Refusal"}}}
    return {
        "operationId": question.replace(" ", "_"),
        "summary": (asked.load().__doc__ or question).strip().splitlines()[0],
        "description": f"Needs the role {role_needed(question).word}.",
        "requestBody": {"required": True, "content": body},
        "responses": {
            "200": {"description": "the answer", "content": content},
            **{status: {"description": text, "content": refusal} for status, text in _REFUSALS.items()},
        },
    }
