"""Friction files as `palpate friction` writes them, with made-up findings."""

from palpate.friction.friction_file import FrictionEstimate, FrictionFile, How, LoadFinding, friction_file_text


def finding(value, lower=None, upper=None, how=How.MEASURED) -> FrictionEstimate:
    """An estimate; within 1 % if nothing else is given."""
    lower = 0.99 * value if lower is None else lower
    return FrictionEstimate(value=value, lower=lower, upper=1.01 * value if upper is None else upper, how=how)


ASSUMED = finding(1.7, 1.0, 2.0, How.ASSUMED)
FLAT = finding(0.002, 0.0, 0.012)


def found_friction(mu=0.8, e=0.002, gamma=0.2, p=1.5, loads=(1.0, 4.0)) -> FrictionFile:
    """Findings of a surface; numbers stand for findings within 1 %."""
    mu, e, gamma, p = (each if isinstance(each, FrictionEstimate) else finding(each) for each in (mu, e, gamma, p))
    return FrictionFile(
        palpate_friction=1,
        provenance="a test",
        friction=mu,
        speed=0.01,
        spin_length=e,
        load_exponent=gamma,
        norm_exponent=p,
        loads=tuple(LoadFinding(normal_force=load, friction=mu, spin_length=e) for load in loads),
    )


def friction_file(folder, **values):
    """The path of a file with these findings."""
    path = folder / "friction.yaml"
    path.write_text(friction_file_text(found_friction(**values)), encoding="utf-8")
    return path
