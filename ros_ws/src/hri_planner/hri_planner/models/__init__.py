"""Trained models that ship with the package: ``.npz`` files of plain arrays."""
