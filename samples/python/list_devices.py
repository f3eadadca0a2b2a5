#!/usr/bin/env python3
"""Lists the devices of this machine, and the plugins that were refused, with the reason.

list_devices.py
"""
import defrec
from input import run


def main() -> None:
    major, minor = defrec.library_version()
    print(f"defrec {defrec.library_release()}, API {major}.{minor}")
    with defrec.Context() as context:  # finds the plugins beside the library
        for device in context.devices:
            conformance = (
                f"conformance suite {device.conformance} passed"
                if device.conformance
                else "no conformance certified"
            )
            print(
                f"device {device.id}: {device.name} ({device.kind.name}), "
                f"driver {device.driver or 'none'}, {device.memory_bytes >> 20} MiB, "
                f"{len(device.stages)} of {defrec.STAGE_COUNT_V1} stages, {conformance}"
            )
        for plugin in context.plugins:
            if plugin.verdict < 0:
                print(f"refused {plugin.path}: {plugin.reason}")


if __name__ == "__main__":
    run(main, "list_devices", 0, 0)
