"""The page in a browser: any size, order and filters, videos, verdicts, names, contrast, keyboard.

These tests need Chromium. Without it they are skipped and say so; `scripts/setup --browser`
installs it.
"""

import json
import shutil
from collections.abc import Iterator
from pathlib import Path

import pytest

from teasim.pool.weight_table import WeightRow, read_weight_table
from teasim.pool.writers.subtask_names import read_names
from tests.filtering.browser import Browser, browser, find_chromium
from tests.filtering.report_pages import STEPS, view, write_page

LARGEST_PAGE = 20_000_000
"""A page of 300 videos is smaller [bytes]."""
SOON = 2.0
"""A page of 300 videos is ready after this processor time of the browser [s]."""
JUDGED = "document.getElementById('judged').textContent"
CONTRAST = (Path(__file__).parent / "contrast.js").read_text()


@pytest.fixture(scope="module")
def tab(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Browser]:
    program = find_chromium()
    if program is None:
        pytest.skip("chromium is not installed; run scripts/setup --browser to test the page in it")
    profile = tmp_path_factory.mktemp("profile")
    with browser(program, profile) as opened:
        opened.look(1280, 900)
        yield opened
        assert opened.errors == []
    shutil.rmtree(profile, ignore_errors=True)


@pytest.fixture(scope="module")
def large(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return write_page(tmp_path_factory.mktemp("large"), 300)


@pytest.fixture(scope="module")
def small(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return write_page(tmp_path_factory.mktemp("small"), 15)


@pytest.fixture
def page(tab: Browser, small: Path, tmp_path: Path) -> Browser:
    """A page of 15 videos, three of them flagged; downloads are saved in a folder of the test."""
    tab.forget()
    tab.look(1280, 900)
    tab.open(small)
    tab.send("Page.setDownloadBehavior", behavior="allow", downloadPath=str(tmp_path))
    return tab


def order(tab: Browser) -> list[int]:
    """Numbers of the videos that are shown, in their order."""
    found = tab.run(
        "[...document.querySelectorAll('.demo:not([hidden])')].map(d => +d.dataset.index)"
    )
    return list(found)


def choose(tab: Browser, name: str, value: str) -> None:
    tab.run(
        f"(e => {{ e.value = {json.dumps(value)}; e.dispatchEvent(new Event('input')); "
        f"e.dispatchEvent(new Event('change')); }})(document.getElementById('{name}'))"
    )


def click(tab: Browser, selector: str) -> None:
    tab.run(f"document.querySelector({json.dumps(selector)}).click()")


def downloaded(tab: Browser, folder: Path, name: str) -> Path:
    path = folder / name
    tab.until(path.exists, f"{name} is downloaded")
    return path


@pytest.mark.slow
def test_300_videos_are_ready_soon_and_in_order(tab: Browser, large: Path) -> None:
    assert large.stat().st_size < LARGEST_PAGE
    tab.send("Performance.enable", timeDomain="threadTicks")
    tab.open(large)
    metrics = {m["name"]: m["value"] for m in tab.send("Performance.getMetrics")["metrics"]}
    assert 0 < metrics["TaskDuration"] < SOON
    demos = [view(index) for index in range(300)]
    by_weight = sorted(demos, key=lambda demo: (demo.weight, demo.episode_index))
    assert order(tab) == [demo.episode_index for demo in by_weight]
    choose(tab, "order", "index")
    assert order(tab) == list(range(300))
    choose(tab, "show", "flagged")
    assert order(tab) == [demo.episode_index for demo in demos if demo.flagged]
    assert tab.run("document.querySelectorAll('video').length") == 0  # nothing is loaded unasked
    assert tab.errors == []


def test_groups_search_and_links(page: Browser) -> None:
    choose(page, "order", "group")
    demos = [view(index) for index in range(15)]
    by_group = sorted(demos, key=lambda d: (-d.group_number, d.weight, d.episode_index))
    assert order(page) == [demo.episode_index for demo in by_group]
    choose(page, "group", "steps left out")
    assert order(page) == [4]
    choose(page, "group", "")
    choose(page, "search", "WATER is missing")
    assert sorted(order(page)) == [4, 9, 14]
    assert page.run("document.getElementById('count').textContent") == "3 of 15 shown"
    page.run("location.hash = '#demo-0'")  # a link to a video that is filtered away shows it
    page.wait("document.querySelectorAll('.demo:not([hidden])').length === 15")


def test_one_video_plays_at_a_time_from_the_moment_that_was_clicked(page: Browser) -> None:
    click(page, "#demo-4 .mark button")
    page.wait("document.querySelector('#demo-4 .film video')?.currentTime >= 10")
    page.wait("!document.querySelector('#demo-4 .film video').paused")
    click(page, "#demo-4 .pair:not([hidden]) figure:last-child .poster")
    page.wait("document.querySelector('#demo-4 figure video')?.currentTime >= 8")
    assert page.run("document.querySelector('#demo-4 .film video').paused")
    page.wait("document.querySelector('#demo-4 figure video').paused")  # it ends with the stretch
    assert 9 <= page.run("document.querySelector('#demo-4 figure video').currentTime") < 11
    click(page, "#demo-4 [data-pick=cup]")
    page.wait("document.querySelector('#demo-4 .film video').src.endsWith('demo_000000_1.mp4')")
    click(page, "#demo-0 .poster")
    page.wait("document.querySelector('#demo-0 video')?.currentTime > 0")
    playing = "[...document.querySelectorAll('video')].filter(v => !v.paused).length"
    assert page.run(playing) == 1
    assert page.errors == []


def test_verdicts_become_a_weight_table(page: Browser, tmp_path: Path) -> None:
    click(page, "#save-weights")
    path = downloaded(page, tmp_path, "weights.csv")
    told = [view(index) for index in range(15)]
    assert [row_of(demo) for demo in told] == list(read_weight_table(path))
    path.unlink()
    click(page, "#demo-4 [data-says=correct]")  # overruled
    click(page, "#demo-9 [data-says=incorrect]")  # confirmed
    click(page, "#demo-0 [data-says=incorrect]")  # overruled
    click(page, "#demo-1 [data-says=correct]")
    click(page, "#demo-1 [data-says=correct]")  # taken back
    assert page.run(JUDGED) == "1 confirmed, 2 overruled."
    page.reload()  # they survive it
    assert page.run(JUDGED) == "1 confirmed, 2 overruled."
    click(page, "#save-weights")
    rows = read_weight_table(downloaded(page, tmp_path, "weights.csv"))
    assert rows[1] == row_of(told[1])
    assert [(r.weight, r.flagged, r.group, r.p_incorrect) for r in (rows[4], rows[0], rows[9])] == [
        (1.0, False, 0, 0.0),
        (0.0, True, 1, 1.0),
        (0.0, True, told[9].group_number, 1.0),
    ]
    assert rows[4].reason == "A person calls it correct. The filter said: " + told[4].reason
    assert rows[9].reason == told[9].reason
    choose(page, "show", "open")
    assert sorted(set(range(15)) - set(order(page))) == [0, 4, 9]


def test_verdicts_and_names_reach_the_page_in_another_tab(page: Browser, small: Path) -> None:
    name = f"name-{STEPS.index('turn_on')}"
    with page.other_tab():
        page.open(small)
        click(page, "#demo-9 [data-says=incorrect]")
        choose(page, name, "light")
        ((key, text),) = page.stored().items()
    page.run(f"localStorage.setItem({json.dumps(key)}, {json.dumps(text)})")
    page.run(f"dispatchEvent(new StorageEvent('storage', {{ key: {json.dumps(key)} }}))")
    assert page.run(JUDGED) == "1 confirmed, 0 overruled."
    assert page.run(f"document.getElementById('{name}').value") == "light"
    click(page, "#demo-0 [data-says=incorrect]")  # which takes nothing back
    kept = page.stored()
    with page.other_tab():
        page.store(kept)
        page.open(small)
        assert page.run(JUDGED) == "1 confirmed, 1 overruled."
        assert page.run(f"document.getElementById('{name}').value") == "light"
    assert page.errors == []


def row_of(demo) -> WeightRow:
    return WeightRow(
        demo.demo_id,
        demo.episode_index,
        demo.weight,
        demo.loss,
        demo.flagged,
        demo.group_number,
        demo.reason,
        demo.p_incorrect,
    )


def test_names_are_used_everywhere_and_downloaded(page: Browser, tmp_path: Path) -> None:
    assert page.run("document.getElementById('save-names').disabled")
    choose(page, f"name-{STEPS.index('add_water')}", " pour <b> ")
    choose(page, f"name-{STEPS.index('turn_on')}", "light")
    texts = page.run("document.getElementById('demos').innerText")
    assert "pour <b> is missing" in texts
    assert "'pour <b>' was expected" in texts
    named = "[...document.querySelectorAll('#demos .n')].map(e => e.textContent + e.title)"
    assert not any("add water" in text for text in page.run(named))
    click(page, "#save-names")
    names = read_names(downloaded(page, tmp_path, "names.json"))
    assert names == {"add_water": "pour <b>", "turn_on": "light"}
    choose(page, f"name-{STEPS.index('add_water')}", "")  # the old name comes back
    assert "add water is missing" in page.run("document.getElementById('demos').innerText")


def test_the_labels_of_the_pool_can_be_hidden(page: Browser) -> None:
    assert "By the labels of the pool: incorrect" in page.run("document.body.innerText")
    click(page, "#truth")
    assert "By the labels of the pool" not in page.run("document.body.innerText")
    assert "skip of" not in page.run("document.body.innerText")


@pytest.mark.parametrize("dark", [False, True], ids=["light", "dark"])
@pytest.mark.parametrize("width", [1280, 390])
def test_every_text_can_be_read(page: Browser, width: int, dark: bool) -> None:
    click(page, "#demo-4 [data-says=correct]")
    page.look(width, 900, dark=dark)
    assert page.run(CONTRAST) == []
    assert page.run("document.documentElement.scrollWidth") <= width


def test_it_works_without_a_mouse(page: Browser) -> None:
    named = (
        "[...document.querySelectorAll('button, input, select')].filter(e => "
        "!(e.textContent.trim() || e.getAttribute('aria-label') || e.labels?.length))"
        ".map(e => e.outerHTML)"
    )
    assert page.run(named) == []
    assert (
        page.run(
            'document.querySelectorAll(\'#demo-0 .segment[tabindex="0"], #demo-0 '
            ".segment:not([tabindex])').length"
        )
        == 1
    )
    page.run("document.querySelector('#demo-0 .segment').focus()")
    for key in ("ArrowRight", "ArrowRight", "ArrowLeft"):
        page.send("Input.dispatchKeyEvent", type="keyDown", key=key, code=key)
    assert page.run("document.activeElement.textContent") == "add tea"
    page.send("Input.dispatchKeyEvent", type="keyDown", key="Enter", code="Enter", text="\r")
    page.wait("document.querySelector('#demo-0 video')?.currentTime >= 2")
