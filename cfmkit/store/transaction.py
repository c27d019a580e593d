"""Changing many files as one: all of the plan or none of it, whenever the process dies.

Everything happens in a hidden folder inside the output folder, on the same file
system, so that each step is a rename::

    .cfmkit-run/new/...     the files of this run, written and on the disk
    .cfmkit-run/old/...     second names of the files that will be replaced or removed
    .cfmkit-run/plan.json   what is to be done, written when all of that is there
    .cfmkit-run/undo.json   the same file, renamed: what is to be undone

The moment at which ``plan.json`` takes its name is the commit: before it, the folder is untouched; after it, `recover`
in the next run does what is left. A failure within the commit renames the plan to ``undo.json`` (which needs no space
on a full disk) and puts the old files back; dying there is repaired likewise. The manifest is replaced last, and the
plan is removed after that.
"""

from __future__ import annotations

import json
import os
from contextlib import suppress
from dataclasses import asdict, dataclass
from typing import TYPE_CHECKING

from cfmkit.errors import OutputError
from cfmkit.store import safe_disk_changes
from cfmkit.store.file_names_and_overwrite_checks import (
    MANIFEST_NAME,
    OVERWRITE_REMEDY,
    checked_name,
    hash_in,
    mode_of,
    refuse_in_the_way,
)
from cfmkit.store.safe_disk_changes import quote_path, reason, remove_empty, reporting, sync_folder

if TYPE_CHECKING:
    from collections.abc import Iterable
    from pathlib import Path

TRANSACTION_FOLDER = ".cfmkit-run"
NEW_FOLDER, OLD_FOLDER, PLAN_NAME, UNDO_NAME = "new", "old", "plan.json", "undo.json"


@dataclass(frozen=True)
class Change:
    """One file of a plan: the hash of its content after and before, None if there is no file."""

    name: str
    new: str | None
    old: str | None


@dataclass(frozen=True)
class CommitPlan:
    """All changes of a commit in the order of execution, and the folders that it will create."""

    changes: tuple[Change, ...]
    folders: tuple[str, ...]


def plan_for(root: Path, new: dict[str, str], removed: Iterable[str]) -> CommitPlan:
    """Return the plan that installs the staged files `new` (name -> hash) and removes others."""
    changes = [Change(name, new[name], hash_in(root, name)) for name in sorted(new) if name != MANIFEST_NAME]
    changes += [Change(name, None, hash_in(root, name)) for name in sorted(removed)]
    changes += [Change(MANIFEST_NAME, new[MANIFEST_NAME], hash_in(root, MANIFEST_NAME))]
    above = {parent for name in new for parent in _parents(name)}
    return CommitPlan(tuple(changes), tuple(sorted(name for name in above if mode_of(root / name) is None)))


def execute(root: Path, plan: CommitPlan) -> None:
    """Carry out a plan whose new files are staged.

    Raises OSError or OutputError if any step fails. The old files are back in place, unless the disk refused that too:
    then the message says so, and the next run puts it right.
    """
    try:
        _link_old_files(root, plan)
        safe_disk_changes.atomic_write(
            root / TRANSACTION_FOLDER / PLAN_NAME, json.dumps(asdict(plan), indent=1).encode()
        )
        _roll_forward(root, plan)
    except BaseException as error:
        with suppress(OSError, OutputError):
            _turn_back(root, plan)
        if isinstance(error, OSError) and _has_plan(root):
            half = f"{quote_path(root)} is half-way between two runs; the next run into it repairs it"
            raise OutputError(f"cannot write {quote_path(root)}: {reason(error)}; {half}") from error
        raise


def recover(root: Path) -> None:
    """Finish or undo what a run that died left behind, and clear its working folder.

    Raises OutputError if that is not possible now; nothing is lost, and the next run tries again.
    """
    run = root / TRANSACTION_FOLDER
    if (mode := mode_of(run)) is None:
        return
    if not run.is_dir() or run.is_symlink():
        raise OutputError(
            f"{quote_path(run)} is in the way: it is not a folder of cfmkit (mode {mode:o}); {OVERWRITE_REMEDY}"
        )
    with reporting(root, "repair"):
        if mode_of(run / UNDO_NAME) is not None:
            _roll_back(root, _read_plan(root, UNDO_NAME))
        elif mode_of(run / PLAN_NAME) is not None:
            _resume_plan(root, _read_plan(root, PLAN_NAME))
    clear(root)


def clear(root: Path) -> None:
    """Remove the working folder, unless it holds a plan that the next run has to finish."""
    if mode_of(root / TRANSACTION_FOLDER) is not None and not _has_plan(root):
        safe_disk_changes.clear_folder(root / TRANSACTION_FOLDER)


def _has_plan(root: Path) -> bool:
    return any(mode_of(root / TRANSACTION_FOLDER / name) is not None for name in (PLAN_NAME, UNDO_NAME))


def _link_old_files(root: Path, plan: CommitPlan) -> None:
    """Give every file that will go a second name, and bring all names down to the disk."""
    for change in plan.changes:
        if change.old is not None:
            target = root / TRANSACTION_FOLDER / OLD_FOLDER / change.name
            safe_disk_changes.make_folders(target.parent)
            safe_disk_changes.duplicate(root / change.name, target)
    for branch in (NEW_FOLDER, OLD_FOLDER):
        for folder, _, _ in os.walk(root / TRANSACTION_FOLDER / branch):
            sync_folder(type(root)(folder))
    sync_folder(root / TRANSACTION_FOLDER)
    sync_folder(root)


def _roll_forward(root: Path, plan: CommitPlan) -> None:
    touched = {root}
    for change in plan.changes:
        if change.name == MANIFEST_NAME:
            _sync_folders(touched)
        _apply_change(root, change)
        touched |= {root / parent for parent in _parents(change.name)}
    _sync_folders(touched)
    # Only now: undoing this would need new folders, which a full disk may refuse.
    remove_empty(root / parent for change in plan.changes if change.new is None for parent in _parents(change.name))
    safe_disk_changes.system.unlink(root / TRANSACTION_FOLDER / PLAN_NAME)


def _apply_change(root: Path, change: Change) -> None:
    """Put one new file in its place, or take one old file away, unless that is done already."""
    place, staged = root / change.name, root / TRANSACTION_FOLDER / NEW_FOLDER / change.name
    if change.new is None:
        if mode_of(place) is not None:
            _refuse_changed(root, change)
            safe_disk_changes.system.unlink(place)
    elif mode_of(staged) is not None:
        _refuse_changed(root, change)
        safe_disk_changes.make_folders(place.parent)
        safe_disk_changes.system.replace(staged, place)


def _refuse_changed(root: Path, change: Change) -> None:
    """Raise if the file in place is neither the one that the plan knew nor the new one."""
    place = root / change.name
    if mode_of(place) is not None and hash_in(root, change.name) not in {change.old, change.new} - {None}:
        raise OutputError(f"{quote_path(place)} was changed while a run was replacing it; {OVERWRITE_REMEDY}")


def _resume_plan(root: Path, plan: CommitPlan) -> None:
    """Roll forward if every new file is there, as it is after any kill; else roll back."""
    hashes = (
        hash_in(root / TRANSACTION_FOLDER / NEW_FOLDER, change.name) or hash_in(root, change.name)
        for change in plan.changes
    )
    if all(change.new in (None, hash_there) for change, hash_there in zip(plan.changes, hashes, strict=True)):
        _roll_forward(root, plan)
        return
    _turn_back(root, plan)


def _turn_back(root: Path, plan: CommitPlan) -> None:
    """Undo a plan, if it was ever begun."""
    run = root / TRANSACTION_FOLDER
    if mode_of(run / PLAN_NAME) is not None:
        safe_disk_changes.system.replace(run / PLAN_NAME, run / UNDO_NAME)
        _roll_back(root, plan)


def _roll_back(root: Path, plan: CommitPlan) -> None:
    for change in reversed(plan.changes):
        _restore_file(root, change)
    remove_empty(root / name for name in plan.folders)
    with suppress(OSError):
        _sync_folders({root, *(root / parent for change in plan.changes for parent in _parents(change.name))})
    safe_disk_changes.system.unlink(root / TRANSACTION_FOLDER / UNDO_NAME)


def _restore_file(root: Path, change: Change) -> None:
    place, kept = root / change.name, root / TRANSACTION_FOLDER / OLD_FOLDER / change.name
    hash_there = hash_in(root, change.name)
    if change.old is None:
        if hash_there is not None and hash_there == change.new:
            safe_disk_changes.system.unlink(place)
    elif hash_there != change.old and mode_of(kept) is not None:
        safe_disk_changes.make_folders(place.parent)
        safe_disk_changes.system.replace(kept, place)


def _sync_folders(folders: Iterable[Path]) -> None:
    for folder in sorted(folders):
        if folder.is_dir():
            sync_folder(folder)


def _parents(name: str) -> list[str]:
    """Return the folders above a name, outermost first: ``a/b/c`` -> ``a``, ``a/b``."""
    parts = name.split("/")
    return ["/".join(parts[:count]) for count in range(1, len(parts))]


def _read_plan(root: Path, name: str) -> CommitPlan:
    """Return a plan, checked: it decides what is replaced and removed."""
    path = root / TRANSACTION_FOLDER / name
    try:
        data = json.loads(path.read_bytes())
        plan = CommitPlan(tuple(Change(**change) for change in data["changes"]), tuple(data["folders"]))
        names = [change.name for change in plan.changes if change.name != MANIFEST_NAME]
        for item in (*names, *plan.folders):
            checked_name(item)
    except (ValueError, KeyError, TypeError, AttributeError, RecursionError, OutputError):
        raise OutputError(
            f"{quote_path(path)} is not a plan of cfmkit; remove {quote_path(path.parent)} to go on"
        ) from None
    for change in plan.changes:
        refuse_in_the_way(root, change.name, ours=True)
    return plan
