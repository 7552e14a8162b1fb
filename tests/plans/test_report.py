"""The report for the reader."""

from __future__ import annotations

from fesd_robot.plans import Plan, report
from fesd_robot.plans.audit_record import ENTRIES, Finding


def test_the_verdict_comes_first(plan: Plan) -> None:
    """Name and status message open the report."""
    assert report(plan).startswith(f"# drop\n\n**{plan.status.message}**\n")


def test_every_audit_entry_stands_in_the_report(plan: Plan) -> None:
    """Each entry of the audit has one row with value, limit and whether it passed."""
    rows = [line for line in report(plan).splitlines() if line.startswith(("| min_", "| max_"))]
    assert [row.split(" | ")[0].strip("| ") for row in rows] == list(ENTRIES)
    for row, (name, limit) in zip(rows, plan.audit.tolerances.items(), strict=True):
        assert f"{getattr(plan.audit, name):.3e}" in row and f"{limit:g}" in row and row.endswith("| yes |")


def test_a_failed_entry_is_marked(plan: Plan) -> None:
    """An entry beyond its limit says so in its row and in the status table, and is explained below its table."""
    audit = plan.audit.model_copy(update={"violations": ["max_energy_error"]})
    status = plan.status.model_copy(update={"audit_passed": False})
    lines = report(plan.model_copy(update={"audit": audit, "status": status})).splitlines()
    assert [line for line in lines if line.endswith("| no |")] == [
        line for line in lines if line.startswith("| max_energy_error")
    ]
    assert "| physics audit | failed: max_energy_error |" in lines
    assert [line for line in lines if line.startswith("- `")] == [
        f"- `max_energy_error` is {ENTRIES['max_energy_error'].meaning}."
    ]


def test_a_near_miss_looks_different(plan: Plan) -> None:
    """An entry a few per cent beyond its limit is "nearly", with the part of the limit; the status says the same."""
    limit = plan.audit.tolerances["max_energy_error"]
    near = plan.audit.model_copy(update={"max_energy_error": 1.04 * limit, "violations": ["max_energy_error"]})
    status = plan.status.model_copy(update={"audit_passed": False, "near_miss": True})
    lines = report(plan.model_copy(update={"audit": near, "status": status})).splitlines()
    assert [line for line in lines if line.endswith("| 1 | nearly |")] == [
        line for line in lines if line.startswith("| max_energy_error")
    ]
    (answer,) = [line for line in lines if line.startswith("| physics audit")]
    assert "nearly passed, but for max_energy_error (" in answer and "4 % more)" in answer


def test_limits_of_the_task_are_marked(plan: Plan) -> None:
    """A limit that is not the default is named in the status and in its row, with the default."""
    audit = plan.audit.model_copy(
        update={"tolerances": {**plan.audit.tolerances, "min_gap": 0.02}, "defaults": {"min_gap": 1e-3}}
    )
    text = report(plan.model_copy(update={"audit": audit}))
    assert "| physics audit | passed; limits of the task: min_gap -0.02 m, default 0.001 m |" in text
    (row,) = [line for line in text.splitlines() if line.startswith("| min_gap")]
    assert ">= -0.02 (the task's; default 0.001)" in row


def test_findings_are_listed(plan: Plan) -> None:
    """What the audit has found stands below its table, one sentence a line; without any there is no such section."""
    assert "#### Findings" not in report(plan)
    sentences = ["At t = 0.2 s (interval 1) contact 'foot' pulls.", "From t = 0 s on (interval 0) there are two."]
    findings = [Finding(entry="max_normal_force_violation", sentence=sentence) for sentence in sentences]
    text = report(plan.model_copy(update={"audit": plan.audit.model_copy(update={"findings": findings})}))
    assert "#### Findings\n\n" + "".join(f"- {sentence}\n" for sentence in sentences) in text


def test_contacts_costs_and_effort(plan: Plan) -> None:
    """Switches, impulses, shares of the cost, sizes and every NLP of the homotopy are in the report."""
    text = report(plan)
    for fragment in (
        "| 0.201928 | foot | touchdown |",
        "| 0.201928 | foot | 0.1816 | 0.0000 |",
        "| configuration | 3 | 75.0 % |",
        "10 variables, 9 constraints, 4 complementarity pairs",
        "| 1e+00 | 1e+03 | converged | 7 | 0.3 |",
        "git none; 2024-01-01",
    ):
        assert fragment in text


def test_tables_are_rectangular(plan: Plan) -> None:
    """Every table has as many cells in each row as in its header."""
    widths: list[int] = []
    for line in report(plan).splitlines():
        if not line.startswith("|"):
            widths = []
            continue
        widths.append(line.count(" | "))
        assert widths[-1] == widths[0], line


def test_a_plan_without_contact(plan: Plan) -> None:
    """A motion with neither switch nor impulse nor cost still has a report."""
    statistics = plan.statistics.model_copy(update={"cost_terms": {}, "homotopy": []})
    assert "# drop" in report(plan.model_copy(update={"switches": [], "impulses": [], "statistics": statistics}))


def test_people_come_before_numbers(plan: Plan) -> None:
    """Sections in the order of what a reader asks; the picture is there if it was drawn."""
    headings = [line for line in report(plan).splitlines() if line.startswith("## ")]
    use = "## Use of friction and effort"
    assert headings == ["## Outcome", use, "## Contact", "## Cost", "## Numbers", "## Provenance"]
    assert "![" not in report(plan)
    assert "![The robot at a few moments](figures/snapshots.png)\n" in report(plan, "figures/snapshots.png")
