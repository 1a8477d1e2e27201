"""How many cases were tried in all."""


def pytest_terminal_summary(terminalreporter):
    """Add up what the tests have recorded, in whichever process they ran."""
    reports = terminalreporter.stats.get("passed", ())
    counts = {report.nodeid: dict(report.user_properties).get("cases", 0) for report in reports}
    if any(counts.values()):
        terminalreporter.write_line(f"fuzz: {sum(counts.values())} cases")
        for name, count in counts.items():
            if count:
                terminalreporter.write_line(f"  {count:9d} {name}")
