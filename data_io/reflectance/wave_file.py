"""A fitted model of waves as a TOML file that can be loaded again."""

from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

from data_io.reflectance.model_tables import INDEX_KEYS, checked_table, index_table
from pbrdf.errors import DataFileError
from pbrdf.files import complete_file, read_toml

if TYPE_CHECKING:
    from pbrdf import WaveModel

__all__ = ["read_wave_model", "write_wave_model"]

# Key in the file: argument of the model
_KEYS = {
    "height_rms_um": "height_rms",
    "corr_length_um": "corr_length",
    "autocorrelation": "autocorrelation",
    "exponent": "exponent",
    "method": "method",
}


def write_wave_model(
    model: "WaveModel", path: str | Path, *, notes: Mapping[str, Any] | None = None
) -> None:
    """Write a wave model, and beside it what else should be remembered.

    Parameters
    ----------
    model : WaveModel
        With a constant index and an autocorrelation known by its name.
    path : str or Path
        The file; appears whole or not at all.
    notes : mapping, optional
        Further tables of the file; `read_wave_model` leaves them alone.

    Raises
    ------
    ValueError
        If the index, the autocorrelation or the spectrum is tabulated.
    """
    import tomli_w

    index = index_table(model.material)
    if model.psd is not None or not isinstance(model.autocorrelation, str):
        msg = "autocorrelation must be a name to be written, got a table or a function."
        raise ValueError(msg)
    given = {key: getattr(model, name) for key, name in _KEYS.items()}
    table = {key: value for key, value in given.items() if value is not None}
    text = tomli_w.dumps({"wave": table, "material": index, **(notes or {})})
    with complete_file(path) as stage:
        stage.write_text(text, encoding="utf-8")


def read_wave_model(path: str | Path) -> "WaveModel":
    """Read the model that `write_wave_model` or `pbrdf fit --height-rms-um` wrote.

    Raises
    ------
    DataFileError
        If the file is not TOML, or a key is missing, unknown or has a wrong value.

    Examples
    --------
    >>> import tempfile
    >>> from pbrdf import Material, WaveModel
    >>> model = WaveModel(Material(1.53), height_rms=0.12, corr_length=2.5)
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     write_wave_model(model, Path(folder) / "model.toml")
    ...     read_wave_model(Path(folder) / "model.toml").corr_length
    2.5
    """
    from pbrdf import Material, WaveModel

    source = Path(path)
    document = read_toml(source)
    wave = checked_table(
        document, "wave", set(_KEYS), {"height_rms_um", "corr_length_um"}, source
    )
    index = checked_table(document, "material", INDEX_KEYS, {"n"}, source)
    try:
        given = {_KEYS[key]: value for key, value in wave.items()}
        return WaveModel(Material(**index), **given)
    except (TypeError, ValueError, OverflowError) as error:
        problem, _, cure = str(error).partition(". ")
        raise DataFileError(source, problem, cure or "Mend the value.") from error
