"""The fitted microfacet model as a TOML file that can be loaded again."""

import math
from collections.abc import Mapping
from dataclasses import fields
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from data_io.reflectance.model_tables import INDEX_KEYS, checked_table, index_table
from pbrdf.errors import DataFileError
from pbrdf.files import complete_file, read_toml

if TYPE_CHECKING:
    from pbrdf.analytic import MicrofacetModel

__all__ = ["model_text", "read_model", "write_model"]

# In the file an angle carries its unit, and so is in degrees
_ANGLES = ("shadow_omega", "shadow_tau")


def model_text(model: "MicrofacetModel", notes: Mapping[str, Any] | None = None) -> str:
    """Return the text of the file that `write_model` writes, with the same errors."""
    import tomli_w

    index = index_table(model.material)
    if not isinstance(model.slope_distribution, str):
        msg = "slope_distribution must be a name to be written, got a table of slopes."
        raise ValueError(msg)
    given = {name: getattr(model, name) for name in _names(model)}
    # TOML has no word for what is not known
    table = {
        _key(name): _to_file(name, value)
        for name, value in given.items()
        if value is not None
    }
    return tomli_w.dumps({"model": table, "material": index, **(notes or {})})


def write_model(
    model: "MicrofacetModel", path: str | Path, *, notes: Mapping[str, Any] | None = None
) -> None:
    """Write a model with a constant index, and beside it what else should be remembered.

    Parameters
    ----------
    model : MicrofacetModel
        Its material must be constant: a fit holds at its wavelength.
    path : str or Path
        The file; appears whole or not at all.
    notes : mapping, optional
        Further tables of the file, such as uncertainties; `read_model` leaves them alone.

    Raises
    ------
    ValueError
        If the index or the slope distribution is tabulated.
    """
    text = model_text(model, notes)
    with complete_file(path) as stage:
        stage.write_text(text, encoding="utf-8")


def read_model(path: str | Path) -> "MicrofacetModel":
    """Read the model that `write_model` or `pbrdf pipeline` wrote.

    Raises
    ------
    DataFileError
        If the file is not TOML, or a key is missing, unknown or has a wrong value.

    Examples
    --------
    >>> import tempfile
    >>> from pbrdf import Material, MicrofacetModel
    >>> model = MicrofacetModel(Material(1.53), slope_rms=0.252, specular_gain=0.8)
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     write_model(model, Path(folder) / "model.toml")
    ...     read_model(Path(folder) / "model.toml") == model
    True
    """
    from pbrdf.analytic import MicrofacetModel
    from pbrdf.optics.materials import Material

    source = Path(path)
    document = read_toml(source)
    names = {_key(name): name for name in _names(MicrofacetModel)}
    if "wave" in document:
        problem = "holds a model of waves"
        raise DataFileError(source, problem, "Read it with data_io.read_wave_model.")
    table = checked_table(document, "model", set(names), {"slope_rms"}, source)
    index = checked_table(document, "material", INDEX_KEYS, {"n"}, source)
    values = {names[key]: _from_file(names[key], value) for key, value in table.items()}
    try:
        return MicrofacetModel(Material(**index), **values)
    except (TypeError, ValueError, OverflowError) as error:
        problem, _, cure = str(error).partition(". ")
        raise DataFileError(source, problem, cure or "Mend the value.") from error


def _names(model: Any) -> list[str]:
    """Return the parameters of the model beside its material."""
    return [field.name for field in fields(model) if field.name != "material"]


def _key(name: str) -> str:
    if name == "height_rms":
        return "height_rms_um"
    return f"{name}_deg" if name in _ANGLES else name


def _to_file(name: str, value: Any) -> Any:
    if isinstance(value, str):
        return value
    return np.asarray(np.rad2deg(value) if name in _ANGLES else value, float).tolist()


def _from_file(name: str, value: Any) -> Any:
    if name in _ANGLES:
        # What is no number is refused by name by the model
        return math.radians(value) if isinstance(value, int | float) else value
    return tuple(value) if isinstance(value, list) else value
