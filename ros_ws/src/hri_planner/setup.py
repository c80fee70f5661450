"""Build description for colcon (ament_python)."""

from glob import glob

from setuptools import find_packages, setup

PACKAGE = "hri_planner"

setup(
    name=PACKAGE,
    version="0.1.0",
    packages=find_packages(include=[PACKAGE, f"{PACKAGE}.*"]),
    package_data={
        PACKAGE: [
            "py.typed",
            "robot/*.urdf",
            "config/*.yaml",
            "experiments/*.yaml",
            "models/*.npz",
            "models/*.json",
        ]
    },
    data_files=[
        ("share/ament_index/resource_index/packages", [f"resource/{PACKAGE}"]),
        (f"share/{PACKAGE}", ["package.xml"]),
        (f"share/{PACKAGE}/urdf", glob("hri_planner/robot/*.urdf")),
        (f"share/{PACKAGE}/config", glob("hri_planner/config/*.yaml")),
    ],
    zip_safe=False,
    maintainer="The HRI stack maintainers",
    maintainer_email="maintainers@hri-stack.example",
    description="Robot motion: KUKA LWR4+ model, motion planning around predicted people.",
    license="Apache-2.0",
    entry_points={
        "console_scripts": [
            "adaptation = hri_planner.nodes.adaptation_node:main",
            "policy = hri_planner.nodes.policy_node:main",
            "ptomp = hri_planner.nodes.ptomp_node:main",
            "separation_monitor = hri_planner.nodes.separation_monitor_node:main",
        ]
    },
)
