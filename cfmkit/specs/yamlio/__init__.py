"""YAML to specifications and back, with the line and column of every fault.

``read_document(text, "cam.yaml").set("design.force=60 N").bind(CamSpec)`` gives a specification or a
`cfmkit.errors.SpecError` that lists everything wrong at once. `dump` writes one that reads back equal.
"""

from cfmkit.specs.yamlio.document import YamlDocument, read_document
from cfmkit.specs.yamlio.dump import dump
from cfmkit.specs.yamlio.explain_validation_errors import did_you_mean, spec_error

__all__ = ["YamlDocument", "did_you_mean", "dump", "read_document", "spec_error"]
