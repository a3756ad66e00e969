"""Tests of scenes, simulation, traces and their comparison."""

import signal
import threading
import time

import numpy as np
import pytest
import spring_oracle as so


def pendulum(**options):
    scene = so.Scene("implicit-euler", **{"time_step": 0.02, "duration": 0.5, **options})
    a, b = scene.particle([0, 0], fixed=True), scene.particle([1, 0.2], velocity=[0, 1], mass=2)
    scene.force("spring", edge=scene.edge(a, b), k=100, l0=1, b=0.5)
    scene.force("simplegravity", fx=0, fy=-9.81)
    return scene


def test_a_scene_is_its_file_and_its_simulation_has_the_shape(tmp_path):
    scene = pendulum()
    assert scene.positions.shape == (2, 2) and scene.masses.tolist() == [1, 2] and scene.fixed.tolist() == [True, False]
    assert scene.forces[0] == {"kind": "springforce", "particles": [0, 1], "k": 100.0, "l0": 1.0, "b": 0.5}
    path = tmp_path / "pendulum.xml"
    scene.save(path)
    again = so.Scene.read(path, strict=True)
    trace, other = so.simulate(scene), so.simulate(again)
    assert trace.positions.shape == (26, 2, 2) == trace.velocities.shape and trace.times[-1] == 0.5
    assert np.array_equal(trace.positions, other.positions)
    assert trace.positions.base is not None, "the array was copied"
    assert np.array_equal(trace.positions[:, 0], np.zeros((26, 2)))


def test_symplectic_euler_by_hand():
    scene = so.Scene(time_step=0.25, duration=1.0)
    scene.particle([0, 0], velocity=[1, 0], mass=2)
    scene.force("simplegravity", fx=0, fy=-10)
    assert so.simulate(scene).positions[-1].tolist() == [[1.0, -6.25]]


def test_three_dimensions_and_other_methods():
    scene = so.Scene("runge-kutta-4", time_step=0.01, duration=0.1, dimension=3)
    scene.particle([0, 0, 1], velocity=[0, 0, -1])
    scene.force("simplegravity", fx=0, fy=0, fz=-9.81)
    trace = so.simulate(scene)
    assert trace.positions.shape == (11, 1, 3)
    assert trace.positions[-1, 0, 2] == pytest.approx(1 - 0.1 - 0.5 * 9.81 * 0.01, abs=1e-12)
    assert so.simulate(scene.changed("explicit-euler", time_step=0.05)).positions.shape == (3, 1, 3)


@pytest.mark.parametrize(
    ("build", "message"),
    [
        (lambda s: s.force("spring", edge=0, k=-1, l0=1), "k"),
        (lambda s: s.force("spring", edge=0, k=1), "l0"),
        (lambda s: s.force("spring", edge=0, k=1, l0=1, damping=2), "damping"),
        (lambda s: s.force("spring", edge=7, k=1, l0=1), "no edge 7; there are 1"),
        (lambda s: s.force("sprin", edge=0), "springforce"),
        (lambda s: s.particle([0, 0], mass=0), "m"),
        (lambda s: s.particle([0, 0, 0]), "must have 2"),
        (lambda s: s.edge(0, 0), "edge"),
        (lambda s: s.changed("implict-euler"), "implicit-euler"),
    ],
)
def test_what_is_refused_has_the_message_of_files(build, message):
    scene = pendulum()
    before = scene.to_xml()
    with pytest.raises(so.SceneError, match=message):
        build(scene)
    assert scene.to_xml() == before


def test_files_that_cannot_be_read(tmp_path):
    with pytest.raises(so.SceneError, match="nowhere.xml"):
        so.Scene.read(tmp_path / "nowhere.xml")
    with pytest.raises(so.SceneError, match="mine:1:"):
        so.Scene.from_xml("<scene><duration/></scene>", name="mine")
    with pytest.raises(so.TraceError, match="nowhere.csv"):
        so.load_trace(tmp_path / "nowhere.csv")
    (tmp_path / "bad.csv").write_text("step,time,x0,y0,vx0,vy0\n0,0.0,1,2,3,x\n")
    with pytest.raises(so.TraceError, match="bad.csv:2: .*not a number"):
        so.load_trace(tmp_path / "bad.csv")


def test_traces_are_read_and_compared(tmp_path):
    trace = so.simulate(pendulum())
    path = tmp_path / "trace.csv"
    trace_csv(trace, path)
    read = so.load_trace(path)
    assert np.array_equal(read.positions, trace.positions) and np.array_equal(read.times, trace.times)
    assert so.compare(read, trace)
    read.velocities[7, 1, 0] += 1e-6
    found = so.compare(read, trace)
    wrong = found.first_wrong
    assert found.verdict == "differs" and (wrong["step"], wrong["particle"], wrong["quantity"], wrong["axis"]) == (7, 1, "velocity", "x")
    assert so.compare(read, trace, tolerances=(1e-5, 1.0))
    short = so.Trace(trace.times[:-1], trace.positions[:-1], trace.velocities[:-1])
    assert so.compare(short, trace).verdict == "too-short"
    with pytest.raises(ValueError, match="state of the trace"):
        so.compare(so.Trace(trace.times, trace.positions[:, :1], trace.velocities[:, :1]), trace)


def trace_csv(trace, path):
    rows = np.concatenate([trace.positions, trace.velocities], axis=2).reshape(len(trace), -1)
    header = "step,time," + ",".join(f"{name}{p}" for p in range(2) for name in ("x", "y", "vx", "vy"))
    lines = [",".join([str(step), repr(float(t)), *(repr(float(v)) for v in row)]) for step, (t, row) in enumerate(zip(trace.times, rows))]
    path.write_text("\n".join([header, *lines]) + "\n")


def test_energies_and_laws():
    scene = pendulum()
    trace = so.simulate(scene)
    kinetic, potential = trace.energies()
    assert kinetic[0] == pytest.approx(1.0) and kinetic.shape == potential.shape == (26,)
    force, by_x, by_v = scene.laws()
    assert force.shape == (4,) and by_x.shape == (4, 4) and np.allclose(by_v, by_v.T)
    step = np.zeros(4)
    step[2] = 1e-6
    x = scene.positions.ravel()
    slope = (scene.laws(x + step)[0] - scene.laws(x - step)[0]) / 2e-6
    assert np.allclose(slope, by_x[:, 2], atol=1e-5)


def test_a_step_that_fails_is_an_exception():
    scene = so.Scene("symplectic-euler")
    a, b = scene.particle([0, 0]), scene.particle([0, 0])
    scene.force("spring", edge=scene.edge(a, b), k=1, l0=1)
    with pytest.raises(so.SimulationError, match="step 1"):
        so.simulate(scene)


def long_scene():
    return pendulum(time_step=1e-5, duration=60.0)


def test_the_lock_is_released():
    beats, ended = 0, threading.Event()
    scene = pendulum(time_step=1e-4, duration=20.0)
    thread = threading.Thread(target=lambda: (so.simulate(scene), ended.set()))
    thread.start()
    while not ended.is_set():
        beats += 1
        time.sleep(0.001)
    thread.join()
    assert beats > 20, f"{beats} beats during a simulation"


def test_ctrl_c_ends_a_simulation():
    signal.signal(signal.SIGALRM, signal.default_int_handler)
    signal.setitimer(signal.ITIMER_REAL, 0.2)
    with pytest.raises(KeyboardInterrupt):
        so.simulate(long_scene())


def test_tables_and_plots():
    pandas = pytest.importorskip("pandas", reason="pandas is not installed")
    plt = pytest.importorskip("matplotlib.pyplot", reason="matplotlib is not installed")
    plt.switch_backend("agg")
    scene = pendulum()
    trace = so.simulate(scene)
    table = trace.to_pandas()
    assert isinstance(table, pandas.DataFrame) and list(table.columns[:5]) == ["time", "x0", "y0", "vx0", "vy0"]
    assert table["vy1"].iloc[3] == trace.velocities[3, 1, 1]
    assert len(scene.plot().collections) == 3
    assert len(trace.plot().lines) == 4 and len(trace.plot_energies().lines) == 3
    wrong = so.check_jacobian(lambda x: x**2, lambda x: np.diag(3 * x), [1.0, 2.0])
    assert wrong.plot().images[0].get_array().shape == (2, 2)
    plt.close("all")


@pytest.mark.parametrize("shown", [pendulum(), so.simulate(pendulum()), so.compare(so.simulate(pendulum()), so.simulate(pendulum()))])
def test_rich_display(shown):
    assert shown._repr_html_().startswith("<") and len(repr(shown)) < 400


def test_drawn_scenes_run_and_survive_their_files():
    hypothesis = pytest.importorskip("hypothesis", reason="hypothesis is not installed")
    from spring_oracle.strategies import scenes

    kinds = set()

    @hypothesis.settings(max_examples=60, deadline=None, suppress_health_check=list(hypothesis.HealthCheck), derandomize=True)
    @hypothesis.given(scenes())
    def check(scene):
        kinds.update(force["kind"] for force in scene.forces)
        again = so.Scene.from_xml(scene.to_xml(), strict=True)
        assert again.to_xml() == scene.to_xml()
        try:
            trace = so.simulate(scene)
        except so.SimulationError:
            return
        assert so.compare(so.simulate(again), trace)

    check()
    assert len(kinds) > 5, kinds
