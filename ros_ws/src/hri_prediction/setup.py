"""Build description for colcon (ament_python)."""

from setuptools import find_packages, setup

PACKAGE = "hri_prediction"

setup(
    name=PACKAGE,
    version="0.1.0",
    packages=find_packages(include=[PACKAGE, f"{PACKAGE}.*"]),
    package_data={PACKAGE: ["py.typed", "ros/*.xml", "hybrid/*.json", "models/*"]},
    data_files=[
        ("share/ament_index/resource_index/packages", [f"resource/{PACKAGE}"]),
        (f"share/{PACKAGE}", ["package.xml"]),
    ],
    zip_safe=False,
    maintainer="The HRI stack maintainers",
    maintainer_email="maintainers@hri-stack.example",
    description="Human motion: tracks, bags, arm geometry and online prediction of reaching.",
    license="Apache-2.0",
    entry_points={
        "console_scripts": [
            "interaction_monitor = hri_prediction.nodes.interaction_monitor_node:main",
            "mocap_live = hri_prediction.nodes.mocap_live_node:main",
            "predictor = hri_prediction.nodes.predictor_node:main",
        ]
    },
)
