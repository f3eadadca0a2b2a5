"""The names of the tests in C++ files."""
import re

TEST_CASE = re.compile(
    r'TEST_CASE(?:_FIXTURE|_TEMPLATE)?\(\s*(?:\w+,\s*)?((?:"(?:[^"\\]|\\.)*"\s*)+)'
)


def test_names(path):
    """Names of a file's tests, in its order; a name that the code wraps is one."""
    for match in TEST_CASE.finditer(path.read_text()):
        yield "".join(re.findall(r'"((?:[^"\\]|\\.)*)"', match.group(1)))
