"""Build description for colcon (ament_python)."""

from glob import glob

from setuptools import find_packages, setup

PACKAGE = "hri_sim"

setup(
    name=PACKAGE,
    version="0.1.0",
    packages=find_packages(include=[PACKAGE, f"{PACKAGE}.*"]),
    package_data={PACKAGE: ["py.typed", "scenarios/*.yaml", "ontology/*.json"]},
    data_files=[
        ("share/ament_index/resource_index/packages", [f"resource/{PACKAGE}"]),
        (f"share/{PACKAGE}", ["package.xml"]),
        (f"share/{PACKAGE}/launch", glob("launch/*.launch.py")),
        (f"share/{PACKAGE}/scenarios", glob("hri_sim/scenarios/*.yaml")),
    ],
    zip_safe=False,
    maintainer="The HRI stack maintainers",
    maintainer_email="maintainers@hri-stack.example",
    description="MuJoCo robot and scene, simulated people, recorder, launch supervisor and test kit.",
    license="Apache-2.0",
    entry_points={
        "console_scripts": [
            "simulator = hri_sim.nodes.simulator_node:main",
            "person = hri_sim.nodes.person_node:main",
            "observer = hri_sim.nodes.observer_node:main",
            "dyad = hri_sim.nodes.dyad_node:main",
            "replayer = hri_sim.nodes.replayer_node:main",
            "recorder = hri_sim.nodes.recorder_node:main",
        ]
    },
)
