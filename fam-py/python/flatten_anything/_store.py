"""Results kept by the content of their inputs, in a folder or an object store."""

from __future__ import annotations

import io
import json
import os
import uuid
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow.fs

#: File systems of `pyarrow.fs` on which a file appears only when it is complete. On others it is
#: written under another name first.
_OBJECT_STORES = {"abfs", "gcs", "s3"}

#: Written last: where it is, the result is complete.
_RECORD = "record.json"
_UVS = "uvs.npy"


class Store:
    """A folder of results: `KE/KEY/` holds an asset with its UVs, its UVs alone and its record."""

    def __init__(self, place: str) -> None:
        """Take a path or any URI that `pyarrow.fs` understands; a path holds on all machines."""
        self._place = place if "://" in place else os.path.abspath(place)
        self._files, root = pyarrow.fs.FileSystem.from_uri(self._place)
        self._root: str = root.rstrip("/")

    def get(self, key: str) -> dict[str, Any] | None:
        """Return the row that was put there; none if there is none, or none that is complete."""
        try:
            row: dict[str, Any] = json.loads(self._read(key, _RECORD))
            row["uvs"] = np.load(io.BytesIO(self._read(key, _UVS)))
        except (FileNotFoundError, ValueError):
            return None
        row["file"] = self._uri(key, row["file"])
        return row

    def put(self, key: str, row: dict[str, Any], asset: Path) -> dict[str, Any]:
        """Keep a row, its asset and all files beside that; return the row with the asset's URI."""
        for path in sorted(asset.parent.rglob("*")):
            if path.is_file():
                name = path.relative_to(asset.parent).as_posix()
                self._write(key, name, path.read_bytes())
        uvs = io.BytesIO()
        np.save(uvs, row["uvs"])
        self._write(key, _UVS, uvs.getvalue())
        record = {name: value for name, value in row.items() if name != "uvs"}
        record["file"] = asset.name
        self._write(key, _RECORD, json.dumps(record, indent=1).encode())
        return {**row, "file": self._uri(key, asset.name)}

    def _folder(self, key: str) -> str:
        # A thousand assets of every first two digits are a quarter of a million.
        return f"{key[:2]}/{key}"

    def _uri(self, key: str, name: str) -> str:
        place, mark, query = self._place.partition("?")
        return f"{place.rstrip('/')}/{self._folder(key)}/{name}{mark}{query}"

    def _read(self, key: str, name: str) -> bytes:
        with self._files.open_input_stream(f"{self._root}/{self._folder(key)}/{name}") as stream:
            content: bytes = stream.read()
        return content

    def _write(self, key: str, name: str, content: bytes) -> None:
        path = f"{self._root}/{self._folder(key)}/{name}"
        if self._files.type_name in _OBJECT_STORES:
            self._write_to(path, content)
            return
        folder, _, last = path.rpartition("/")
        self._files.create_dir(folder, recursive=True)
        temporary = f"{folder}/.{last}.{uuid.uuid4().hex}"
        self._write_to(temporary, content)
        self._files.move(temporary, path)

    def _write_to(self, path: str, content: bytes) -> None:
        with self._files.open_output_stream(path) as stream:
            stream.write(content)
