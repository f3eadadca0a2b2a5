"""Which platform the wheel's tag names, by what objdump prints of the libraries in it."""
import pathlib
import sys
import unittest

sys.path.insert(0, str(pathlib.Path(__file__).parents[1]))
from wheel_platform import platform  # noqa: E402


def dump(*needed, versions=()):
    lines = [
        "Dynamic Section:",
        *(f"  NEEDED               {library}" for library in needed),
        "  SONAME               libdefrec.so.1",
        "",
        "Version References:",
        "  required from libc.so.6:",
        *(f"    0x069691b4 0x00 03 {version}" for version in versions),
    ]
    return "\n".join(lines) + "\n"


class WheelPlatform(unittest.TestCase):
    def test_is_the_newest_glibc_that_a_library_needs(self):
        libraries = [
            dump("libc.so.6", versions=["GLIBC_2.34", "GLIBC_2.2.5"]),
            dump("libm.so.6", versions=["GLIBC_2.29"]),
        ]
        self.assertEqual(platform("x86_64", libraries), "manylinux_2_34_x86_64")

    def test_is_that_of_the_first_distributions_with_the_libstdcxx(self):
        libraries = [
            dump(
                "libstdc++.so.6",
                "libc.so.6",
                versions=["GLIBC_2.14", "GLIBCXX_3.4.30", "CXXABI_1.3.13", "GCC_3.0"],
            )
        ]
        self.assertEqual(platform("aarch64", libraries), "manylinux_2_35_aarch64")

    def test_is_no_older_than_2_17(self):
        self.assertEqual(
            platform("x86_64", [dump("libc.so.6", versions=["GLIBC_2.2.5"])]),
            "manylinux_2_17_x86_64",
        )

    def test_of_another_library_is_this_system_alone(self):
        self.assertEqual(
            platform("x86_64", [dump("libc.so.6"), dump("libyaml-cpp.so.0.7", "libc.so.6")]),
            "linux_x86_64",
        )

    def test_of_symbols_that_are_not_known_is_this_system_alone(self):
        for symbols in ("GLIBCXX_3.4.99", "GLIBC_PRIVATE", "OTHER_1.0"):
            self.assertEqual(
                platform("x86_64", [dump("libc.so.6", versions=[symbols])]), "linux_x86_64", symbols
            )


if __name__ == "__main__":
    unittest.main()
