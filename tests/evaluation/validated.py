"""Records of validations that nobody ran."""

from bluefoot_mpc.evaluation.battery import Verdict
from bluefoot_mpc.evaluation.validation_cases import validation_cases
from bluefoot_mpc.evaluation.validation_plan import Plan
from bluefoot_mpc.evaluation.validation_record import record_table, save_record
from bluefoot_mpc.evaluation.validation_subject import Code, code_now, subject_of
from bluefoot_mpc.scenarios import RunOptions

CODE = Code(
    package="1.0", source="abc", versions={"numpy": "2.0"}, files={"a.py": "1" * 12, "b.py": "2" * 12}
)
NOON = "2026-01-31T12:00:00+00:00"


def kept(case, seed):
    """Figures that just keep every limit of a case."""
    return {limit.figure: limit.bound for limit in case.limits}


def made_up(folder, options=None, plan=None, code=CODE, **changes):
    """A record of a validation; `changes` are values of its figures, `made` its date."""
    made = changes.pop("made", NOON)
    plan = plan or Plan()
    subject = subject_of(options or RunOptions())
    cases = validation_cases(plan, folder / "config.toml")
    verdicts = [
        Verdict(case=case, figures={seed: kept(case, seed) | changes for seed in case.seeds})
        for case in cases
    ]
    return save_record(folder, record_table(subject, code, plan, verdicts, {"made": made}))


def made_with_this_code(folder, **arguments):
    """A record of the code that runs the tests."""
    return made_up(folder, code=code_now(), **arguments)
