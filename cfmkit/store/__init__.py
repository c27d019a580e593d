"""From results to the disk: one output folder, written as a whole or not at all.

    with RunFolder("cfm-out/cam-design") as folder:
        folder.check("curve.csv", "metrics.json")
        folder.write("curve.csv", to_csv(table))
        folder.commit({"seed": 0, "status": "complete", "exit_code": 0})

What a user can rely on
-----------------------
- One run at a time: the folder is locked, and the lock dies with its process.
- Nothing changes before `commit`. A run that fails or is killed leaves the old
  files; killed within the commit, the folder is completed by the next run.
- A run replaces the files that the manifest of the previous run lists, removes
  those of them that it does not write again, and touches nothing else.
- A listed file that was edited since is replaced too, but the edited version is
  kept beside it (``design.edited.yaml``). Refusing would lose the work of a long
  run for the sake of a file that was opened and saved; overwriting would lose the
  edit. Keeping both loses nothing, and the run says so.
- A file that no manifest lists is never replaced: the run refuses, and does so
  before it computes anything if it calls `check` first.

While a run lives, ``.cfmkit.lock`` and ``.cfmkit-run/`` stand in the folder; both
are gone after it, and after a kill both are cleared by the next run.

`run_folder` is what a run works with, and its manifest; `transaction` changes many files as one, `lock` keeps other
runs out, `file_names_and_overwrite_checks` says what may be written, `safe_disk_changes` makes changes and turns their
errors into sentences, `content_hashes_and_versions` gives content its hash.
"""

from cfmkit.store.content_hashes_and_versions import code_stamp, file_hash, origin, stable_hash
from cfmkit.store.run_folder import Manifest, RunFolder
from cfmkit.store.safe_disk_changes import FileRecord, atomic_write

__all__ = ["FileRecord", "Manifest", "RunFolder", "atomic_write", "code_stamp", "file_hash", "origin", "stable_hash"]
