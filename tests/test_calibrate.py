import pytest
import trimesh
from typer.testing import CliRunner

from fabfold.cli.app import app
from fabfold.errors import RecipeError
from fabfold.printing.calibrate import calibrate, write_profile
from fabfold.printing.profiles import load_profile
from hinges.coupon_plan import DEFAULT_CLEARANCES


def test_a_calibrated_profile_survives_its_file(tmp_path):
    shipped = load_profile("fdm-pla-0.4")
    mine = calibrate(shipped, 0.3, fuses_mm=0.2, name="garage")
    assert (mine.clearance_mm, mine.min_gap_mm) == (0.3, 0.25)
    assert mine.min_wall_mm == shipped.min_wall_mm
    assert "0.3 mm turns freely" in mine.sources[0]
    path = tmp_path / "garage.toml"
    write_profile(path, mine)
    assert load_profile(str(path)) == mine


def test_without_the_fused_one_the_share_of_the_gap_is_kept():
    shipped = load_profile("mjf-pa12")
    mine = calibrate(shipped, 0.25)
    share = shipped.min_gap_mm / shipped.clearance_mm
    assert mine.min_gap_mm == pytest.approx(0.25 * share)
    assert mine.name == "my-mjf-pa12"


@pytest.mark.parametrize(("turns", "fuses"), [(0.0, None), (-1, None), (0.3, 0.3), (0.3, 0.4)])
def test_figures_that_contradict_are_refused(turns, fuses):
    with pytest.raises(RecipeError, match="--"):
        calibrate(load_profile("fdm-pla-0.4"), turns, fuses_mm=fuses)


@pytest.mark.slow
def test_the_commands_write_coupon_and_profile(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    run = CliRunner().invoke
    done = run(app, ["calibrate", "--turns-freely", "0.30", "--profile", "fdm-pla-0.4"])
    assert done.exit_code == 0, done.output
    assert load_profile("my-fdm-pla-0.4.toml").clearance_mm == 0.3
    done = run(app, ["coupon", "--profile", "fdm-pla-0.4", "-o", "coupon.stl"])
    assert done.exit_code == 0, done.output
    coupon = trimesh.load_mesh(tmp_path / "coupon.stl")
    # A frame, a flap for each clearance, and the plug.
    assert coupon.body_count == 1 + len(DEFAULT_CLEARANCES) + 1
    done = run(app, ["coupon", "--around", "0.3", "-o", "fine.stl"])
    assert done.exit_code == 0, done.output
    assert trimesh.load_mesh(tmp_path / "fine.stl").body_count == 1 + 7 + 1
    done = run(app, ["calibrate", "--turns-freely", "0.275", "--around", "0.3", "-o", "fine.toml"])
    assert done.exit_code == 0, done.output
    assert load_profile("fine.toml").clearance_mm == 0.275
    pins = ["--pin-grip", "0.2", "--pin-slip", "0.35", "-o", "pins.toml"]
    done = run(app, ["calibrate", "--turns-freely", "0.3", "--profile", "fdm-pla-0.4", *pins])
    assert done.exit_code == 0, done.output
    assert load_profile("pins.toml").apart.slip_mm == 0.175
    assert "pins stay at 0.1 mm and turn at 0.175 mm" in " ".join(done.output.split())
    assert run(app, ["coupon", "--pin", "1.8"]).exit_code == 2
    assert run(app, ["coupon", "--around", "0.3", "--clearances", "0.3"]).exit_code == 2
    assert run(app, ["coupon", "--around", "0.01"]).exit_code == 2
    done = run(app, ["coupon", "-o", "coupon.xyz"])
    assert done.exit_code == 2
    done = run(app, ["coupon", "--clearances", "0.2,x", "-o", "coupon.stl"])
    assert done.exit_code == 2


def test_a_profile_for_bodies_apart_comes_back_with_the_clearance_that_was_read(tmp_path):
    mine = calibrate(load_profile("fdm-pla-0.4"), 0.25, fuses_mm=0.15)
    write_profile(tmp_path / "mine.toml", mine)
    again = load_profile(str(tmp_path / "mine.toml"))
    assert again == mine
    assert again.apart.clearance_mm == 0.25
    assert (again.apart.face_gap_mm, again.apart.grip_mm, again.apart.slip_mm) == (0.2, 0.1, 0.2)


def test_bores_for_pins_are_half_their_numbers_wider_in_radius(tmp_path):
    shipped = load_profile("fdm-pla-0.4")
    mine = calibrate(shipped, 0.3, pin_grip_mm=0.15, pin_slip_mm=0.35)
    assert (mine.apart.grip_mm, mine.apart.slip_mm) == (0.075, 0.175)
    assert "stays in a bore 0.15 mm wider and turns in a bore 0.35 mm wider" in mine.sources[1]
    write_profile(tmp_path / "mine.toml", mine)
    assert load_profile(str(tmp_path / "mine.toml")) == mine
    half = calibrate(shipped, 0.3, pin_slip_mm=0.25)
    assert (half.apart.grip_mm, half.apart.slip_mm) == (shipped.apart.grip_mm, 0.125)
    tight = calibrate(shipped, 0.5, pin_grip_mm=0.15, pin_slip_mm=0.2)
    write_profile(tmp_path / "tight.toml", tight)  # what must stay open is less than the slip
    assert load_profile(str(tmp_path / "tight.toml")).apart.min_gap_mm == 0.05


@pytest.mark.parametrize(
    ("turns", "more", "words"),
    [
        (0.3, {"pin_grip_mm": 0.3, "pin_slip_mm": 0.3}, "--pin-grip 0.3 must be below --pin-slip"),
        (0.3, {"pin_grip_mm": 0.45}, "below --pin-slip 0.4.*the profile's own"),
        (0.3, {"pin_slip_mm": 0.33}, "--pin-slip 0.33: give the number beside the bore"),
        (0.9, {}, "this coupon has 0.15, 0.2"),
        (0.3, {"fuses_mm": 0.12}, "--fuses 0.12"),
        (0.3, {"clearances": (0.6, 0.7)}, "this coupon has 0.6, 0.7"),
        (0.3, {"name": "../mine"}, "no name for a profile"),
    ],
)
def test_numbers_that_are_not_on_the_coupon_are_refused(turns, more, words):
    with pytest.raises(RecipeError, match=words):
        calibrate(load_profile("sls-pa12"), turns, **more)
    mine = calibrate(load_profile("sls-pa12"), 0.7, fuses_mm=0.6, clearances=(0.6, 0.7))
    assert mine.clearance_mm == 0.7


def test_no_profile_is_overwritten(tmp_path):
    mine = calibrate(load_profile("sls-pa12"), 0.3)
    (tmp_path / "mine.toml").write_text("precious")
    with pytest.raises(RecipeError, match="is there already"):
        write_profile(tmp_path / "mine.toml", mine)
    assert (tmp_path / "mine.toml").read_text() == "precious"
    with pytest.raises(RecipeError, match="file ends in"):
        write_profile(tmp_path / "mine.txt", mine)


def test_a_coupon_larger_than_the_bed_is_refused(tmp_path):
    from fabfold.printing.profile_coupon import make_coupon

    many = ",".join(f"{0.2 + 0.01 * step:.2f}" for step in range(30))
    with pytest.raises(RecipeError, match=r"the coupon is .* mm, and the bed 145 x 145 mm"):
        make_coupon(tmp_path / "coupon.3mf", "sla-tough", many)
    assert list(tmp_path.iterdir()) == []
