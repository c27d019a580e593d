"""`tools/mutants.py`: faults of each kind, the same ones for a seed, each a change of one place."""

import ast
import runpy
from pathlib import Path

draw = runpy.run_path(str(Path(__file__).parents[2] / "tools/mutants.py"))["draw"]

CODE = '''"""Two words."""
def area(width, low=2):
    if width > 3.0 and low:
        return min(width, low) * 2
    return width
'''


def test_faults_are_changes_of_one_place_and_repeat_with_their_seed(tmp_path):
    path = tmp_path / "code.py"
    path.write_text(CODE)
    faults = draw([path], 8, seed=3)
    assert faults == draw([path], 8, seed=3)
    texts = {text for _, _, text in faults}
    assert len(texts) == 8  # of the places there are: if, and, >, 3.0, min, *, 2, 2
    assert ast.unparse(ast.parse(CODE)) not in texts
    assert all(ast.parse(text).body[0].value.value == "Two words." for text in texts)
    for part in ("not (width > 3.0 and low)", "width > 3.0 or low", "width > 3.03", "max(width, low)", "/ 2", "* 3"):
        assert any(part in text for text in texts), part
