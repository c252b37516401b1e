"""Vectors, metrics and figures of one vehicle, whether flown in this process or read from a recording."""

from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np

from sls.columns import Columns
from sls.trajectory import Trajectory

if TYPE_CHECKING:
    from matplotlib.figure import Figure
    from pandas import DataFrame

    from sls.metrics import StageMetrics


class VehicleColumns:
    """Arrays have a row for each row of `state`; SI units, radians, frame W."""

    state: Columns
    command: Columns
    reference: Columns
    trajectory: Trajectory

    def _view(self, table: str, first: str, size: int = 3) -> np.ndarray:
        """`size` columns of `table`, from the column `first` on, (rows, size)."""
        columns: Columns = getattr(self, table)
        names = list(columns)
        return columns.stack(names[names.index(first):names.index(first) + size])

    @property
    def reference_position(self) -> np.ndarray:
        """Desired position of the load, (steps, 3), m; NaN for a step without an answer."""
        return self.trajectory.p_WL_ref

    @property
    def force(self) -> np.ndarray:
        """Force on the quadrotor that the controller answered, (steps, 3), N; NaN for a step without an answer."""
        return self.trajectory.f_Q_W

    def __getitem__(self, name: str) -> np.ndarray:
        """The column `name` of `state`. Raises KeyError if there is none."""
        return self.state[name]

    @property
    def time_s(self) -> np.ndarray:
        """Simulation time, (steps,), s."""
        return self.state["sim_time_s"]

    @property
    def quad_position(self) -> np.ndarray:
        """(steps, 3), m."""
        return self._view("state", "quad_x_m")

    @property
    def quad_velocity(self) -> np.ndarray:
        """(steps, 3), m/s."""
        return self._view("state", "quad_vx_m_s")

    @property
    def load_position(self) -> np.ndarray:
        """(steps, 3), m."""
        return self._view("state", "load_x_m")

    @property
    def load_velocity(self) -> np.ndarray:
        """(steps, 3), m/s."""
        return self._view("state", "load_vx_m_s")

    @property
    def alpha(self) -> np.ndarray:
        """Angle of the rod about x, (steps,), rad."""
        return self.state["alpha_rad"]

    @property
    def beta(self) -> np.ndarray:
        """Angle of the rod about y, (steps,), rad."""
        return self.state["beta_rad"]

    @property
    def applied_force(self) -> np.ndarray:
        """Force that acted on the quadrotor over the period before each step, (steps, 3), N."""
        return self._view("state", "force_x_n")

    @property
    def attitude(self) -> np.ndarray | None:
        """Unit quaternions w, x, y, z, body to W, (steps, 4); None if the plant has no attitude."""
        return self._view("state", "att_w", 4) if "att_w" in self.state else None

    @property
    def body_rates(self) -> np.ndarray | None:
        """In the body frame, (steps, 3), rad/s; None if the plant has no attitude."""
        return self._view("state", "rate_x_rad_s") if "rate_x_rad_s" in self.state else None

    def calc_load_error(self) -> np.ndarray:
        """Position of the load minus its reference, (steps, 3), m."""
        return self.load_position - self.reference_position

    @cached_property
    def metrics(self) -> "list[StageMetrics]":
        """Metrics of every stage, each followed by those of its laps (sls.metrics.calc_stage_metrics)."""
        from sls.metrics import calc_stage_metrics
        return calc_stage_metrics(self.trajectory)

    def to_pandas(self) -> "DataFrame":
        """The columns of `state`, `command` and `reference` side by side, by step; NaN for a step without an
        answer. A name that `state` has, too, gets the name of its table: `force_x_n` acts, and the controller
        answers `force_x_n_command`. Raises ImportError without pandas."""
        import pandas
        whole = pandas.DataFrame(dict(self.state)).set_index("step")
        for name, columns in (("command", self.command), ("reference", self.reference)):
            table = pandas.DataFrame(dict(columns)).set_index("step")
            table = table.drop(columns=["vehicle_id", "sim_time_s"], errors="ignore")
            whole = whole.join(table, rsuffix=f"_{name}")
        return whole

    def plot(self) -> "dict[str, Figure]":
        """The figures of `./sls plot`, by name."""
        from sls.figures import make_figures
        return make_figures([self.trajectory])
