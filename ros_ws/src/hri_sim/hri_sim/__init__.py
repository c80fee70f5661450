"""Simulation: MuJoCo robot and scene, simulated people, recorder, launch supervisor, test kit."""
