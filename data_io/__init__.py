"""Files in and out; units and conventions are converted here and nowhere else."""
