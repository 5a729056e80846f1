"""The paper reproduced: its Table III and figures, the page, the numbers, and the command.

Source: Romero Navarrete, Lozano Guzman, Arroyo Contreras, "A Finite Element Model to assess
flexible pavement vehicle interaction", Table III, Figs. 7-12. What our readings of it come to was
found before by an independent program, to the digits below.
"""

from __future__ import annotations

import base64
import dataclasses
import json
import re
import warnings
from html.parser import HTMLParser
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from conftest import Run
from hypothesis import given
from hypothesis import strategies as st

import pavefem as pf
from pavefem.studies import Reproduction, paper_sensitivity, reproduce_paper
from pavefem.studies.paper import cases, numbers, printed, readings, sites

PNG = b"\x89PNG\r\n\x1a\n"
SPEEDS = ("25", "65", "105")
FIGURES = [f"fig_{number}" for number in range(7, 13)]


@pytest.fixture(scope="module")
def paper() -> Reproduction:
    return reproduce_paper()


@pytest.fixture(scope="module")
def html(paper: Reproduction, tmp_path_factory: pytest.TempPathFactory) -> str:
    path = tmp_path_factory.mktemp("page") / "page.html"
    paper.to_html(path)
    return path.read_text("utf-8")


@pytest.fixture(scope="module")
def data(paper: Reproduction, tmp_path_factory: pytest.TempPathFactory) -> dict[str, Any]:
    path = tmp_path_factory.mktemp("numbers") / "paper.json"
    paper.to_json(path)
    found = json.loads(path.read_text("utf-8"), parse_constant=pytest.fail)
    assert isinstance(found, dict)
    return found


@pytest.fixture
def roads(tmp_path: Path) -> Path:
    """Give a folder of three profiles, and three files that are none or no use."""
    folder = tmp_path / "roads"
    folder.mkdir()
    for number, (grade, length) in enumerate([("B", 120.0), ("A", 90.0), ("C", 45.0)]):
        made = pf.Profile.iso8608(grade, length, spacing=0.1, seed=number)
        made.to_csv(folder / f"{grade}.csv")
    pf.Profile.iso8608("A", 20.0, spacing=0.1).to_csv(folder / "short.csv")
    (folder / "broken.csv").write_text("station [m],elevation [m]\n0,0\n1,zero\n2,0\n")
    (folder / "README").write_text("profiles of three roads")
    (folder / ".hidden").write_text("nothing")
    return folder


# --- Table III and the figures ----------------------------------------------------------------


@pytest.mark.parametrize(
    ("reading", "temperature", "vma"),
    [
        ("first", (3.29, 2.80, 2.65), (2.19, 1.84, 1.69)),
        ("second", (3.67, 3.24, 3.12), (2.20, 1.84, 1.69)),
    ],
)
def test_sensitivities_to_temperature_and_vma(
    paper: Reproduction,
    reading: str,
    temperature: tuple[float, ...],
    vma: tuple[float, ...],
) -> None:
    rows = paper.numbers[reading].table.rows
    assert rows["temperature"] == pytest.approx(temperature, abs=0.005)
    assert rows["vma"] == pytest.approx(vma, abs=0.005)


def test_first_reading_is_within_ten_percent_of_table_iii(paper: Reproduction) -> None:
    for row in ("temperature", "vma"):
        assert paper.table_iii.rows[row] == pytest.approx(printed.TABLE_III[row], rel=0.10)
    assert paper.table_iii.ratios["temperature_to_vma"] == pytest.approx(1.53, abs=0.005)


def test_second_reading_is_12_to_17_percent_off_in_temperature(paper: Reproduction) -> None:
    ours = np.array(paper.numbers["second"].table.rows["temperature"])
    off = ours / printed.TABLE_III["temperature"] - 1.0
    assert np.all((off > 0.10) & (off < 0.175))


@pytest.mark.parametrize("reading", ["first", "second"])
def test_order_of_the_sensitivities(paper: Reproduction, reading: str) -> None:
    table = paper.numbers[reading].table
    assert table.order == ["temperature", "vma", "speed", "roughness"]
    assert numbers.PRINTED.order == table.order
    assert max(table.rows["speed"]) < 0.0


def test_second_reading_has_the_levels_of_fig_8(paper: Reproduction) -> None:
    """Peaks at 0.7, 1.3 and 2.2 m, mm, at 25, 65 and 105 km/h."""
    expected = [[0.73, 0.70, 0.70], [0.65, 0.57, 0.57], [0.57, 0.51, 0.51]]
    np.testing.assert_allclose(1e3 * paper.numbers["second"].at_spacings, expected, atol=0.0051)


def test_trends_of_fig_8(paper: Reproduction) -> None:
    found = {
        name: [
            item.ours
            for item in next(f for f in figures if f.name == "fig_8").compared
            if isinstance(item.ours, str)
        ]
        for name, figures in paper.all_figures.items()
    }
    minimum = "a minimum at 1.3 m"
    assert list(printed.FIG_8_TRENDS) == [minimum, minimum, "falls"]
    assert found == {
        "first": [minimum, minimum, minimum],
        "second": [minimum, "falls", "falls"],
    }


def test_nominal_case_stands_in_fig_8(paper: Reproduction) -> None:
    """65 km/h, 1.3 m: 0.643594386 mm, as in the literature tests."""
    peak = paper.numbers["first"].at_spacings[1, 1]
    assert peak == pytest.approx(0.643594386e-3, rel=1e-8)


def test_hottest_point_of_fig_11_is_a_run(paper: Reproduction, road: pf.Road) -> None:
    """The numbers are those of `simulate`, whatever thread they were found on."""
    truck = pf.vehicles.tandem_truck(axle_spacing=1.6)
    with pytest.warns(pf.ValidityWarning, match="3.198 MPa"):
        result = pf.simulate(road, truck, speed_kmh=25.0, temperature_c=40.0, keep="envelope")
    assert paper.numbers["first"].by_temperature[0, -1] == -result.lowest[25]


def test_a_peak_of_fig_9_is_a_run(paper: Reproduction, road: pf.Road) -> None:
    site = paper.sites.used[7]
    result = pf.simulate(
        road,
        pf.vehicles.tandem_truck(axle_spacing=1.6),
        profile=site.profile,
        run_in=50.0,
        interpolation="staircase",
        speed_kmh=105.0,
        keep="envelope",
    )
    assert paper.numbers["first"].by_site[2, 7] == -result.lowest[25]


def test_histories_of_fig_7_have_the_peaks_of_fig_8(paper: Reproduction) -> None:
    figure = paper.figures[0]
    assert [panel.title for panel in figure.panels] == ["25 km/h", "65 km/h", "105 km/h"]
    lowest = [[curve.y.min() for curve in panel.curves] for panel in figure.panels]
    np.testing.assert_allclose(lowest, -paper.numbers["first"].at_spacings, atol=1e-9)


def test_mean_peak_falls_with_speed(paper: Reproduction) -> None:
    for found in paper.numbers.values():
        assert np.all(np.diff(found.by_site.mean(axis=1)) < 0.0)


@pytest.mark.parametrize("reading", ["first", "second"])
@pytest.mark.parametrize("speed_kmh", [25.0, 65.0, 105.0])
def test_modulus_is_held_by_temperature(reading: str, speed_kmh: float) -> None:
    asphalt = readings.READINGS[reading].pavement.asphalt
    temperature = numbers.temperature_of_same_modulus(reading, speed_kmh)
    expected = asphalt.modulus(20.0, 25.0)
    assert asphalt.modulus(temperature, speed_kmh) == pytest.approx(expected, rel=1e-12)


# --- roughness --------------------------------------------------------------------------------


def test_random_profiles_cover_the_range_and_are_the_same_each_time() -> None:
    made, again = sites.random_sites().used, sites.random_sites().used
    assert len(made) == 26
    found = [site.profile.iri() for site in made]
    np.testing.assert_allclose(found, np.linspace(1.0, 8.0, 26), rtol=1e-9)
    assert all(a.profile == b.profile for a, b in zip(made, again, strict=True))


def test_sensitivity_to_roughness_is_from_half_to_half(paper: Reproduction) -> None:
    found = paper.numbers["first"]
    for speed, peaks in enumerate(found.by_site):
        low, high = peaks[:13].mean(), peaks[13:].mean()
        smooth, rough = found.iri[:13].mean(), found.iri[13:].mean()
        expected = (high / low - 1.0) / (rough / smooth - 1.0)
        assert found.table.rows["roughness"][speed] == pytest.approx(expected, rel=1e-12)


def test_standard_error_of_the_sensitivity_to_roughness(paper: Reproduction) -> None:
    """Against the spread of S over resampled profiles of each half."""
    found = paper.numbers["first"]
    rng = np.random.default_rng(0)
    low, high = (half.mean() for half in np.array_split(found.iri, 2))
    drawn = [
        half[:, rng.integers(13, size=(4000, 13))] for half in np.array_split(found.by_site, 2, 1)
    ]
    first, second = (half.mean(axis=-1) for half in drawn)
    spread = ((second / first - 1.0) / (high / low - 1.0)).std(axis=1)
    assert found.roughness_error is not None
    np.testing.assert_allclose(found.roughness_error, spread, rtol=0.12)


def test_profiles_of_a_folder(roads: Path) -> None:
    found = sites.sites_of(roads)
    assert [site.name for site in found.used] == ["A.csv", "B.csv", "C.csv"]
    assert [site.run_in for site in found.used] == pytest.approx([50.0, 50.0, 14.0])
    whole = pf.read_profile(roads / "B.csv")
    assert found.used[1].iri == pytest.approx(whole.slice(0.0, 81.0).iri(), rel=1e-12)
    reasons = dict(found.rejected)
    assert set(reasons) == {"short.csv", "broken.csv", "README"}
    assert "20 m long: road and truck need 31 m" in reasons["short.csv"]
    assert "line 3" in reasons["broken.csv"]


def test_what_is_remarked_of_a_profile_is_kept(tmp_path: Path) -> None:
    for grade in "AB":
        pf.Profile.iso8608(grade, 90.0, spacing=0.5).to_csv(tmp_path / f"{grade}.csv")
    found = sites.sites_of(tmp_path)
    assert len(found.remarks) == 2
    assert "A.csv: the samples of the profile are up to 0.5 m apart" in found.remarks[0]


def test_profiles_of_ones_own(paper: Reproduction) -> None:
    made = [pf.Profile.iso8608(grade, length=100.0, seed=2) for grade in "AB"]
    own = reproduce_paper(profiles=made)
    assert own.numbers["first"].by_site.shape == (3, 2)
    assert own.numbers["first"].roughness_error is None
    for row in ("temperature", "vma"):
        assert own.table_iii.rows[row] == paper.table_iii.rows[row]
    assert own.table_iii.rows["roughness"] == pytest.approx(
        [
            paper_sensitivity([site.iri for site in own.sites.used], peaks, signed=True)
            for peaks in own.numbers["first"].by_site
        ],
        rel=1e-12,
    )


# --- what is outside the range of the formulas ------------------------------------------------


def test_warnings_are_kept_and_not_given() -> None:
    with warnings.catch_warnings(record=True) as given_out:
        warnings.simplefilter("always")
        found = reproduce_paper(profiles=[pf.Profile.iso8608(c, 90.0) for c in "AB"])
    assert not given_out
    assert all("binder stiffness" in text for text in found.warnings)
    places = [case for cases in found.warnings.values() for case in cases]
    assert {(case.reading, case.temperature_c, case.speed_kmh) for case in places} == {
        ("first", 40.0, 25.0),
        ("first", 40.0, 65.0),
        ("second", 35.0, 25.0),
        ("second", 40.0, 25.0),
        ("second", 40.0, 65.0),
        ("second", 40.0, 105.0),
    }


# --- what is written --------------------------------------------------------------------------


def test_numbers_in_json(data: dict[str, Any], paper: Reproduction) -> None:
    assert data["reading"] == "first"
    assert list(data["table_iii"]) == ["temperature", "vma", "roughness", "speed"]
    for row in ("temperature", "vma", "roughness"):
        assert list(data["table_iii"][row]) == [*SPEEDS, "mean"]
    assert list(data["table_iii"]["speed"]) == ["25", "65", "mean"]
    assert data["table_iii"] == data["readings"]["first"]["table_iii"]
    assert data["table_iii"]["vma"]["65"] == paper.table_iii.rows["vma"][1]
    assert data["printed"]["table_iii"]["roughness"]["105"] == -0.00340
    difference = data["readings"]["second"]["difference_percent"]["temperature"]["25"]
    assert difference == pytest.approx(100.0 * (3.669 / 3.279 - 1.0), abs=0.05)
    assert data["printed"]["ratios"]["temperature_to_roughness"] == 1769.0
    assert data["printed"]["ratios"]["temperature_to_roughness_absolute"] == pytest.approx(
        751.0, abs=0.5
    )
    ratios, means = data["ratios"], {row: v["mean"] for row, v in data["table_iii"].items()}
    assert ratios["temperature_to_vma"] == means["temperature"] / means["vma"]


def test_figures_in_json(data: dict[str, Any]) -> None:
    assert list(data["figures"]) == FIGURES
    for figure in data["figures"].values():
        assert figure["understood_as"] and figure["printed"]
        for panel in figure["panels"]:
            assert panel["curves"]
            for curve in panel["curves"]:
                assert len(curve["x"]) == len(curve["y"]) > 1
    fig_8 = data["figures"]["fig_8"]["panels"][0]
    assert fig_8["printed"] == [0.50e-3, 0.75e-3]
    assert fig_8["curves"][0]["x"][0] == 0.7 and fig_8["curves"][0]["x"][-1] == 2.2
    assert [len(curve["x"]) for curve in data["figures"]["fig_9"]["panels"][1]["curves"]] == [
        26
    ] * 3
    assert data["figures"]["fig_11"]["panels"][0]["y"] == "peak deflection [m]"


class Checker(HTMLParser):
    """Follows what is open, and notes sources, headings and text."""

    def __init__(self) -> None:
        super().__init__()
        self.open: list[str] = []
        self.tags: set[str] = set()
        self.sources: list[str] = []
        self.links: list[str] = []
        self.ids: list[str] = []
        self.text: list[str] = []

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        self.tags.add(tag)
        values = {name: value or "" for name, value in attrs}
        self.sources += [values["src"]] if "src" in values else []
        self.links += [values["href"]] if "href" in values else []
        self.ids += [values["id"]] if "id" in values else []
        if tag not in ("meta", "img", "br"):
            self.open.append(tag)

    def handle_endtag(self, tag: str) -> None:
        assert self.open.pop() == tag

    def handle_data(self, data: str) -> None:
        self.text.append(data)


def checked(html: str) -> Checker:
    checker = Checker()
    checker.feed(html)
    checker.close()
    assert checker.open == []
    return checker


def test_page_is_in_one_piece(html: str) -> None:
    """Nothing comes from elsewhere, and every picture is in it."""
    found = checked(html)
    for elsewhere in ("http:", "https:", "//", "url(", "@import"):
        assert elsewhere not in re.sub(r'src="data:[^"]*"', "", html)
    assert not found.tags & {"script", "link", "iframe", "object", "embed"}
    assert len(found.sources) == len(FIGURES)
    for source in found.sources:
        head, _, picture = source.partition(",")
        assert head == "data:image/png;base64"
        assert base64.b64decode(picture, validate=True).startswith(PNG)
    assert set(found.links) == {f"#{name}" for name in found.ids}


def test_page_has_everything(html: str, paper: Reproduction) -> None:
    text = "".join(checked(html).text)
    for number in range(7, 13):
        assert f"Fig. {number} — " in text
    for row, values in printed.TABLE_III.items():
        for value in values:
            digits = 5 if abs(value) < 0.01 else 4 if abs(value) < 1.0 else 3
            assert f"{value:.{digits}f}".replace("-", "−") in text, row
    for ours in ("3.290", "2.803", "2.648", "3.669", "3.238", "3.122", "−6.5 %", "+16.9 %"):
        assert ours in text
    for word in ("1769", "751", "other sign", "differs", "140\u00a0000", "84.3 MN/m", "−0.16"):
        assert word in text
    for warning in paper.warnings:
        assert warning in text
    for site in paper.sites.used:
        assert site.name in text


def test_page_of_the_other_reading(paper: Reproduction) -> None:
    second = dataclasses.replace(paper, reading="second")
    assert second.table_iii is paper.numbers["second"].table
    assert second.figures[1].panels[0].curves[0].y[0] == pytest.approx(0.73e-3, abs=0.5e-5)
    assert second.data()["figures"] != paper.data()["figures"]
    assert second.data()["readings"] == paper.data()["readings"]


def test_names_from_outside_are_escaped(paper: Reproduction, tmp_path: Path) -> None:
    name = "<b>$A & B</i>"
    used = (dataclasses.replace(paper.sites.used[0], name=name), *paper.sites.used[1:])
    odd = dataclasses.replace(
        paper.sites, used=used, rejected=((name, "is <broken>"),), remarks=(name,), origin=name
    )
    dataclasses.replace(paper, sites=odd).to_html(tmp_path / "page.html")
    text = "".join(checked((tmp_path / "page.html").read_text("utf-8")).text)
    assert text.count(name) == 5
    assert "is <broken>" in text


def test_saved_files(paper: Reproduction, tmp_path: Path) -> None:
    folder = tmp_path / "new" / "folder"
    files = paper.save(folder)
    expected = {"paper.html", "paper.json", "table_iii.png", *(f"{name}.png" for name in FIGURES)}
    assert {path.name for path in files} == {path.name for path in folder.iterdir()} == expected
    for path in folder.glob("*.png"):
        assert path.read_bytes().startswith(PNG)
    assert paper.save(folder) == files  # once more, over the old ones


def test_folder_that_cannot_be_written(paper: Reproduction, tmp_path: Path) -> None:
    (tmp_path / "file").write_text("")
    with pytest.raises(OSError, match="cannot write to the folder"):
        paper.save(tmp_path / "file" / "folder")
    assert [path.name for path in tmp_path.iterdir()] == ["file"]


def test_a_figure_there_is_not(paper: Reproduction) -> None:
    with pytest.raises(ValueError, match=r"no figure 'fig_6': must be one of \['fig_7'"):
        paper.plot("fig_6")


def test_stopping_leaves_the_rest_undone(monkeypatch: pytest.MonkeyPatch) -> None:
    started = []
    run = cases._run

    def counted(case: cases.Case, given: Any) -> cases.Answer:
        started.append(case)
        return run(case, given)

    def stop(done: int, total: int) -> None:
        raise KeyboardInterrupt

    monkeypatch.setattr(cases, "_run", counted)
    wanted = [cases.Case("first", 65.0, vma=15.0 + number / 100.0) for number in range(400)]
    with pytest.raises(KeyboardInterrupt):
        cases.run_cases(wanted, [], stop)
    assert len(started) < 100


# --- mistakes ---------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ({"reading": "third"}, r"reading = 'third': must be one of \['first', 'second'\]"),
        ({"reading": 1}, "reading = 1"),
        ({"profiles": 5}, "profiles is a int: must be a folder or a list of Profile"),
        ({"profiles": pf.Profile.smooth(90.0)}, "profiles is a Profile"),
        ({"profiles": ["a.csv"]}, "profiles has a str"),
        ({"profiles": []}, "the profiles given: no profile that can be used, at least 2"),
        ({"profiles": [pf.Profile.iso8608("A", 90.0)]}, "1 profile that can be used, at least 2"),
        ({"profiles": [pf.Profile.iso8608("A", 90.0)] * 2}, "must differ"),
        (
            {"profiles": [pf.Profile.smooth(90.0), pf.Profile.iso8608("A", 30.0)]},
            r"no profile(?s:.*)smooth: is level(?s:.*)seed 0: is 30 m long",
        ),
    ],
    ids=lambda value: value if isinstance(value, str) else "",
)
def test_wrong_inputs(arguments: dict[str, Any], message: str) -> None:
    with pytest.raises(ValueError, match=message):
        reproduce_paper(**arguments)


def test_folders_that_are_none(tmp_path: Path) -> None:
    with pytest.raises(FileNotFoundError, match="no such folder"):
        reproduce_paper(profiles=tmp_path / "absent")
    (tmp_path / "site.csv").write_text("")
    with pytest.raises(NotADirectoryError, match="is not a folder"):
        reproduce_paper(profiles=tmp_path / "site.csv")


# --- the command ------------------------------------------------------------------------------


@pytest.mark.draws
def test_command(pavefem: Run, tmp_path: Path, paper: Reproduction) -> None:
    done = pavefem("paper", "--out", "there", "--reading", "second")
    assert done.code == 0, done.err
    assert done.err == ""
    assert "S of temperature" in done.out and "3.343 (printed 2.960, +12.9 %)" in done.out
    assert "wrote paper.html, paper.json, fig_7.png" in done.out
    assert len(list((tmp_path / "there").iterdir())) == 9
    written = json.loads((tmp_path / "there" / "paper.json").read_text("utf-8"))
    expected = dataclasses.replace(paper, reading="second").data()
    assert written["table_iii"] == expected["table_iii"]
    assert written["figures"] == expected["figures"]


@pytest.mark.draws
def test_command_reports_profiles_that_it_cannot_use(
    pavefem: Run, roads: Path, tmp_path: Path
) -> None:
    done = pavefem("paper", "--profiles", str(roads), "--out", "mine")
    assert done.code == 2
    lines = done.err.splitlines()
    assert len(lines) == 3
    assert all(line.startswith("error: ") for line in lines)
    written = json.loads((tmp_path / "mine" / "paper.json").read_text("utf-8"))
    assert [profile["name"] for profile in written["profiles"]] == ["A.csv", "B.csv", "C.csv"]
    rejected = [profile["name"] for profile in written["rejected_profiles"]]
    assert rejected == ["README", "broken.csv", "short.csv"]
    page = (tmp_path / "mine" / "paper.html").read_text("utf-8")
    assert "Not used" in page and "broken.csv" in page


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (["--profiles", "absent"], "no such folder: absent"),
        (["--profiles", "empty"], "empty: no profile that can be used, at least 2 are needed"),
        (["--profiles", "file"], "file is not a folder; give one that holds profiles"),
        (["--out", "file"], "cannot write to the folder file: File exists"),
        (["--out", "file/folder"], "cannot write to the folder file/folder: Not a directory"),
    ],
)
def test_command_with_a_mistake_writes_nothing(
    pavefem: Run, tmp_path: Path, words: list[str], message: str
) -> None:
    (tmp_path / "empty").mkdir()
    (tmp_path / "file").write_text("")
    assert pavefem("paper", *words).error() == message
    assert {path.name for path in tmp_path.iterdir()} == {"empty", "file"}


def test_command_with_another_reading(pavefem: Run) -> None:
    done = pavefem("paper", "--reading", "third")
    assert done.code == 2
    assert "'third' is not one of 'first', 'second'" in done.err


def test_package_leaves_matplotlib_alone_until_it_draws(run_python: Any) -> None:
    code = "import sys, pavefem.studies; sys.exit('matplotlib' in sys.modules)"
    assert run_python("-c", code).returncode == 0


# --- the paper's S ----------------------------------------------------------------------------


def test_sensitivity_by_hand() -> None:
    x, y = [10.0, 20.0, 40.0], [2.0, 3.0, 1.5]
    steps = [(0.5, 1.0), (-0.5, 1.0)]
    assert paper_sensitivity(x, y) == pytest.approx(np.mean([abs(a) / b for a, b in steps]))
    assert paper_sensitivity(x, y, signed=True) == pytest.approx(0.0, abs=1e-15)


@given(
    st.lists(st.floats(0.1, 10.0), min_size=2, max_size=8, unique_by=lambda v: round(v, 3)),
    st.floats(0.01, 100.0),
    st.floats(0.01, 100.0),
)
def test_sensitivity_knows_no_scale_and_is_one_where_both_go_together(
    x: list[float], by: float, other: float
) -> None:
    values = np.array(x)
    assert paper_sensitivity(values, by * values) == pytest.approx(1.0, rel=1e-9)
    first = paper_sensitivity(values, values**2)
    assert paper_sensitivity(by * values, other * values**2) == pytest.approx(first, rel=1e-6)
    assert paper_sensitivity(values, np.full(values.size, by)) == 0.0


@pytest.mark.parametrize(
    ("x", "y", "message"),
    [
        ([1.0], [1.0], "x has 1 values and y has 1: must be as many, at least 2"),
        ([1.0, 2.0], [1.0], "x has 2 values and y has 1"),
        ([0.0, 10.0], [1.0, 2.0], "x has 0: must be above 0"),
        ([1.0, 2.0], [1.0, -2.0], "y has -2: must be above 0"),
        ([1.0, 2.0, 2.0], [1.0, 2.0, 3.0], "x has 2 twice in a row"),
        ([1.0, np.nan], [1.0, 2.0], r"x\[1\] is nan"),
        ([1.0, 2.0], ["a", "b"], "y must hold real numbers"),
        ([[1.0, 2.0]], [1.0, 2.0], "x must be one-dimensional"),
    ],
)
def test_sensitivity_of_what_has_none(x: Any, y: Any, message: str) -> None:
    with pytest.raises(ValueError, match=message):
        paper_sensitivity(x, y)
