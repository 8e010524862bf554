"""Run time against true error, for scenes of every class: `python -m pbrdf.bench`."""
