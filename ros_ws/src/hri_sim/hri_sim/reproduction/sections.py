"""All sections of the report, in their order; another one is one more entry."""

from __future__ import annotations

from hri_sim.reproduction import adaptation, headline, leads, people, speeds, variants
from hri_sim.reproduction.section import Section

HEADLINE = Section("headline", "The planners side by side", headline.plans, headline.lines)
LEADS = Section("leads", "What a lead is made of", leads.plans, leads.lines)
SECTIONS = (
    HEADLINE,
    LEADS,
    Section("speeds", "Slower machines, other predictions", speeds.plans, speeds.lines),
    Section("ablations", "What the parts are worth", variants.ablation_plans, variants.lines),
    Section("robustness", "Other settings", variants.robustness_plans, variants.lines),
    Section("adaptation", "Parameter adaptation", adaptation.plans, adaptation.lines),
    Section("people", "Other people, worse tracking", people.people_plans, people.people_lines),
    Section("mujoco", "Executed in MuJoCo", people.mujoco_plans, people.mujoco_lines),
)
