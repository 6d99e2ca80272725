"""Another format or method is one file or one entry point, through the same door as the built-in ones."""

from __future__ import annotations

import dataclasses

import pytest

from monitor.exceptions import InputError
from monitor.readers import MethodRules, Reader, method_rules, read_campaign, readers, registry


class Point:
    """An entry point that gives an object, or raises it."""

    name = "mine"
    value = "mine:READER"

    def __init__(self, found):
        self.found = found

    def load(self):
        if isinstance(self.found, Exception):
            raise self.found
        return self.found


@pytest.fixture
def plugged(monkeypatch):
    """Install plug-ins for one test."""

    def install(*found):
        points = [Point(one) for one in found]
        monkeypatch.setattr(registry, "entry_points", lambda group: points if group == registry.GROUP else [])
        readers.cache_clear()
        method_rules.cache_clear()

    yield install
    monkeypatch.undo()
    readers.cache_clear()
    method_rules.cache_clear()


@pytest.mark.parametrize("reader", readers(), ids=lambda reader: reader.name)
def test_contract_of_every_format(reader, tmp_path):
    assert reader.name
    assert reader.recognises(tmp_path) is False


@pytest.mark.parametrize("rules", method_rules().values(), ids=lambda rules: rules.name)
def test_contract_of_every_method(rules):
    assert rules.name
    assert rules.suffixes


def test_a_plugged_in_format_is_asked_before_the_built_in(plugged, small):
    other = dataclasses.replace(read_campaign(small), name="other")
    plugged(Reader("other", lambda folder: (folder / "other.txt").exists(), lambda folder: other))
    assert read_campaign(small).name == "small"
    (small / "other.txt").write_text("")
    assert read_campaign(small).name == "other"


def test_a_plugged_in_method_is_known(plugged, spoil):
    plugged(MethodRules("mine"))
    assert read_campaign(spoil("campaign.toml", '"samba"', '"mine"')).method == "mine"


def test_a_plug_in_that_fails_is_named(plugged, small):
    plugged(ImportError("no module named mine"))
    with pytest.raises(InputError, match=r"the plug-in mine \(mine:READER\) cannot be loaded: no module"):
        read_campaign(small)


def test_a_plug_in_of_another_kind_is_named(plugged, small):
    plugged(42)
    with pytest.raises(
        InputError,
        match=r"the plug-in mine \(mine:READER\) must be a Reader, a MethodRules or an ExportFormat",
    ):
        read_campaign(small)
