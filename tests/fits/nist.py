"""Reader of the NIST StRD nonlinear regression files, with the models for CasADi.

The files are US government data, public domain: NIST/ITL, Statistical Reference Datasets.
Certified values carry eleven digits.
"""

import re
from dataclasses import dataclass
from pathlib import Path

import casadi
import numpy as np

from fitting.objective.objective import Objective, Prediction
from fitting.objective.parameters import Parameter

FOLDER = Path(__file__).parent / "nist_strd"

exp = casadi.exp
MODELS = {
    "MGH09": lambda b, x: b[0] * (x**2 + x * b[1]) / (x**2 + x * b[2] + b[3]),
    "Thurber": lambda b, x: (
        (b[0] + b[1] * x + b[2] * x**2 + b[3] * x**3)
        / (1 + b[4] * x + b[5] * x**2 + b[6] * x**3)
    ),
    "BoxBOD": lambda b, x: b[0] * (1 - exp(-b[1] * x)),
    "Rat42": lambda b, x: b[0] / (1 + exp(b[1] - b[2] * x)),
    "MGH10": lambda b, x: b[0] * exp(b[1] / (x + b[2])),
    "Eckerle4": lambda b, x: b[0] / b[1] * exp(-0.5 * ((x - b[2]) / b[1]) ** 2),
    "Rat43": lambda b, x: b[0] / (1 + exp(b[1] - b[2] * x)) ** (1 / b[3]),
    "Bennett5": lambda b, x: b[0] * (b[1] + x) ** (-1 / b[2]),
}


@dataclass(frozen=True)
class CertifiedProblem:
    """One data set: starts (2, n), certified values and standard deviations, x, y."""

    name: str
    starts: np.ndarray
    values: np.ndarray
    stderr: np.ndarray
    residual_sum: float
    x: np.ndarray
    y: np.ndarray

    def objective(self, start: int) -> Objective:
        """Return the problem from start 0 or 1: no bounds, all data of equal weight."""
        b = casadi.SX.sym("b", len(self.values))
        curve = casadi.Function("curve", [b], [MODELS[self.name](b, casadi.DM(self.x))])
        parameters = [
            Parameter(name=f"b{i + 1}", value=value)
            for i, value in enumerate(self.starts[start])
        ]
        return Objective(
            prediction=Prediction(curve),
            data=self.y,
            stderr=np.ones_like(self.y),
            parameters=parameters,
        )


def read(name: str) -> CertifiedProblem:
    """Read one file of `nist_strd`."""
    lines = (FOLDER / f"{name}.dat").read_text().splitlines()
    rows = [line.split("=")[1].split() for line in lines if re.match(r"\s+b\d\s*=", line)]
    table = np.array(rows, dtype=float)
    total = next(line for line in lines if line.startswith("Residual Sum of Squares"))
    first = max(i for i, line in enumerate(lines) if line.startswith("Data:")) + 1
    data = np.array([line.split() for line in lines[first:] if line.strip()], dtype=float)
    return CertifiedProblem(
        name=name,
        starts=table[:, :2].T,
        values=table[:, 2],
        stderr=table[:, 3],
        residual_sum=float(total.split(":")[1]),
        x=data[:, 1],
        y=data[:, 0],
    )
