"""`pbrdf init`: a scene file to start from."""

from enum import StrEnum
from pathlib import Path
from typing import Annotated

import typer

from pbrdf.cli import options

PAINT = """\
# A glossy paint: random Gaussian surface, polished pigment-free binder over a diffuse base.
# Lengths in micrometres (_um), angles in degrees (_deg).

[surface]
type = "gaussian"
shape = [256, 256]        # cells; the surface repeats beyond them
spacing_um = 1.0          # a sixteenth of the correlation length or less
corr_length_um = 16.0     # where the autocorrelation falls to 1/e
slope_rms = 0.15          # per axis; or height_rms_um

[substrate]
n = 1.5                   # refractive index of the binder
kappa = 0.0               # its imaginary part: no absorption
diffuse_albedo = 0.2      # of the base under the interface
"""

VINYL = """\
# Vinyl siding after section 4.2 of Gartley, Brown and Schott: height rms 2.6 um,
# correlation length 14.5 um, hence slope rms 0.2536.

[surface]
type = "gaussian"
shape = [256, 256]        # cells; the surface repeats beyond them
spacing_um = 0.9          # a sixteenth of the correlation length or less
corr_length_um = 14.5     # where the autocorrelation falls to 1/e
height_rms_um = 2.6       # or slope_rms, per axis

[substrate]
material = "pvc"          # a name of `pbrdf.materials`; or n and kappa
"""

METAL = """\
# Rough aluminium. Its constants depend on the wavelength: simulate with --wavelength-um.

[surface]
type = "gaussian"
shape = [256, 256]        # cells; the surface repeats beyond them
spacing_um = 1.0          # a sixteenth of the correlation length or less
corr_length_um = 16.0     # where the autocorrelation falls to 1/e
slope_rms = 0.3           # per axis; or height_rms_um

[substrate]
material = "aluminium"    # a name of `pbrdf.materials`; or n and kappa
"""

DEW = """\
# Drops of water on a smooth paint: simulate with --wavelength-um.

[surface]
type = "gaussian"
shape = [256, 256]        # cells; the surface repeats beyond them
spacing_um = 1.0          # a sixteenth of the correlation length or less
corr_length_um = 32.0     # where the autocorrelation falls to 1/e
slope_rms = 0.05          # per axis; or height_rms_um

[substrate]
n = 1.5                   # refractive index; kappa = 0, it does not absorb

[[contaminants]]
type = "drops"
material = "water"              # of the drops
contact_angle_deg = 90.0        # between surface and drop, through the water
volume_per_area_um = 2.0        # thickness of the water if it were a film
number_density_per_mm2 = 500.0  # drops on a square millimetre
seed = 1                        # of the places of the drops
"""

FILM = """\
# A film of water of even thickness on rough glass: simulate with --wavelength-um.

[surface]
type = "gaussian"
shape = [256, 256]        # cells; the surface repeats beyond them
spacing_um = 1.0          # a sixteenth of the correlation length or less
corr_length_um = 24.0     # where the autocorrelation falls to 1/e
slope_rms = 0.1           # per axis; or height_rms_um

[substrate]
n = 1.5                   # refractive index; kappa = 0, it does not absorb

[[contaminants]]
type = "film"
material = "water"        # of the film
thickness_um = 20.0       # even everywhere; interference is not modelled
"""

MAP = """\
# A measured height map, traced as it is. heights.npy: heights in micrometres, x first, as
# numpy.save writes them; other formats are read by `pbrdf statistics`.

[surface]
type = "height_map"
file = "heights.npy"
spacing_um = 0.5          # step of the grid; or two, of x and of y
periodic = false          # true if its borders continue each other

[substrate]
n = 1.5                   # refractive index; kappa = 0, it does not absorb
"""

MESH = """\
# A triangle mesh, overhangs included: STL, PLY, OBJ, GLB, glTF or OFF beside this file. z
# points up. Numbers are micrometres unless a unit is named. Metals need --wavelength-um.

[surface]
type = "mesh"
file = "mesh.stl"
# unit = "mm"               # nm, um, mm, cm, m, inch: that of the numbers in the file
# period_um = [40.0, 40.0]  # if it repeats; else it is a sheet, or bodies that stand alone
# labels = "parts"          # numbers the parts of the file, each with a material below
# transparent = [1]         # labels of closed parts that light goes through, or true

[substrate]
n = 1.5                   # refractive index; kappa = 0, it does not absorb
# or a list in the order of the labels: materials = [{n = 1.5}, {material = "aluminium"}]
"""


class Kind(StrEnum):
    """What to start from."""

    paint = "paint"
    vinyl = "vinyl"
    metal = "metal"
    dew = "dew"
    film = "film"
    map = "map"
    mesh = "mesh"


TEXTS = {
    Kind.paint: PAINT,
    Kind.vinyl: VINYL,
    Kind.metal: METAL,
    Kind.dew: DEW,
    Kind.film: FILM,
    Kind.map: MAP,
    Kind.mesh: MESH,
}


def command(
    file: Annotated[
        Path, typer.Argument(help="Scene file to write, or - for standard output.")
    ] = Path("scene.toml"),
    kind: Annotated[Kind, typer.Option("--kind", help="What to start from.")] = Kind.paint,
    force: options.Force = False,
) -> None:
    """Write a scene file to start from, with a remark on each number.

    Example: pbrdf init paint.toml --kind paint
    """
    from pbrdf.cli.staging import staged_file

    text = TEXTS[kind]
    if str(file) == "-":
        typer.echo(text, nl=False)
        return
    with staged_file(file, force=force) as stage:
        stage.write_text(text, encoding="utf-8")
    tabulated = "simulate with --wavelength-um" in text
    wave = " --wavelength-um 0.55" if tabulated else ""
    typer.echo(f"Written: {file}")
    typer.echo(f"Next:    pbrdf simulate {file} --theta-i-deg 30,60{wave} -o result.nc")
    typer.echo("         pbrdf plot result.nc")
