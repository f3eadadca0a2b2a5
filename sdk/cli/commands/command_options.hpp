// Options that more than one subcommand has.
#pragma once

#include <CLI/CLI.hpp>
#include <string>

#include "sdk/contract/descs.hpp"
#include "sdk/io/calibration.hpp"
#include "sdk/io/number_checks.hpp"

namespace defrec::cli {

inline void add_device_options(CLI::App& command, std::string& backend, std::string& device,
                               unsigned& threads) {
    command
        .add_option("--backend", backend,
                    "auto, cpu, reference, or another that `defrec devices` lists")
        ->type_name("NAME")
        ->capture_default_str();
    command
        .add_option("--device", device, "The device by its whole id, as `defrec devices` shows it")
        ->type_name("ID");
    command.add_option("--threads", threads, "Threads of the library; 0: one for each core")
        ->type_name("N")
        ->check(CLI::Range(0, int{kContextMaxThreads}));
}

inline void add_deadline_option(CLI::App& command, std::uint64_t& deadline_ns) {
    command
        .add_option_function<double>(
            "--deadline",
            [&deadline_ns](double ms) { deadline_ns = static_cast<std::uint64_t>(1e6 * ms); },
            "When a frame is to be done after its submission, ms: what is not expected to fit is "
            "left out, and the frame's reasons say so; default: no deadline")
        ->type_name("MS")
        ->check(number_in(1e-6, 1e6));
}

inline void add_units_option(CLI::App& command, LengthUnit& units) {
    command
        .add_option_function<std::string>(
            "--units",
            [&units](const std::string& name) {
                units = name == "m" ? LengthUnit::kMetre : LengthUnit::kMillimetre;
            },
            "Unit of the calibration's baseline, mm or m, where it is not the format's own")
        ->type_name("UNIT")
        ->check(CLI::IsMember({"mm", "m"}));
}

}  // namespace defrec::cli
