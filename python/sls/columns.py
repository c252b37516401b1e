"""The columns of a recording's file, by their names in that file."""

from collections.abc import Callable, Iterator, Mapping, Sequence

import numpy as np


class Columns(Mapping[str, np.ndarray]):
    """A mapping from the names of columns to arrays (rows,), in the order of the file. Numbers are
    float64; `vehicle_id`, `step` and `stage` int64; `fault` and `stage_name` text."""

    def __init__(self, columns: Mapping[str, np.ndarray | Callable[[], np.ndarray]]):
        """A function in place of an array is called on the first use of its column."""
        self._columns = dict(columns)

    def __getitem__(self, name: str) -> np.ndarray:
        """The column `name`. Raises KeyError, with the known names, if there is none."""
        if name not in self._columns:
            raise KeyError(f"expected a column, one of {', '.join(self._columns)}; got {name!r}")
        column = self._columns[name]
        if not isinstance(column, np.ndarray):
            column = self._columns[name] = column()
        return column

    def __iter__(self) -> Iterator[str]:
        return iter(self._columns)

    def __len__(self) -> int:
        return len(self._columns)

    def __contains__(self, name: object) -> bool:
        return name in self._columns

    def __repr__(self) -> str:
        return f"Columns({', '.join(self._columns)})"

    def stack(self, names: Sequence[str]) -> np.ndarray:
        """A copy of the columns `names`, side by side, (rows, len(names))."""
        return np.column_stack([self[name] for name in names])

    def take(self, names: Sequence[str]) -> np.ndarray:
        """As `stack`; the mapping gives these columns up, and so their memory."""
        values = self.stack(names)
        for name in names:
            del self._columns[name]
        return values
