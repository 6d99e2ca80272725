"""Pictures that a question drew, as a notebook shows them and a folder keeps them."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from pathlib import Path

from monitor.api.arguments import argument
from monitor.exceptions import InputError


class Pictures:
    """The pictures of an answer by file name, each as SVG and as PNG."""

    def __init__(self, files: Iterable[Path]) -> None:
        self._files = {Path(file).name: Path(file).read_bytes() for file in files}

    @property
    def names(self) -> tuple[str, ...]:
        """The file names."""
        return tuple(self._files)

    def __iter__(self) -> Iterator[str]:
        return iter(self._files)

    def __len__(self) -> int:
        return len(self._files)

    def __getitem__(self, name: str) -> bytes:
        """Return the bytes of a file. Raises InputError for a name that there is not, with those that there are."""
        try:
            return self._files[name]
        except (KeyError, TypeError):
            raise InputError(f"there is no picture '{name}'; there are {', '.join(self._files)}") from None

    def save(self, folder: str | Path) -> tuple[Path, ...]:
        """Write the pictures into a folder, made where there is none; return their paths.

        Raises InputError where it cannot be written.
        """
        path: Path = argument("folder", folder, Path)
        try:
            path.mkdir(parents=True, exist_ok=True)
            for name, content in self._files.items():
                (path / name).write_bytes(content)
        except OSError as error:
            raise InputError(f"{path} cannot be written: {error.strerror or error}") from error
        return tuple(path / name for name in self._files)

    def __repr__(self) -> str:
        return f"Pictures({', '.join(self._files)})"

    def _repr_html_(self) -> str:
        """Return the drawings one below the other, as a notebook shows them."""
        return "\n".join(self._drawings())

    def first(self) -> str:
        """Return the first drawing as SVG inside HTML; empty where there is none."""
        return next(iter(self._drawings()), "")

    def _drawings(self) -> list[str]:
        texts = [content.decode("utf-8") for name, content in self._files.items() if name.endswith(".svg")]
        return [text[text.index("<svg") :] for text in texts]
