// `defrec devices` on the command line.
#include <CLI/CLI.hpp>
#include <memory>
#include <nlohmann/json.hpp>

#include "sdk/cli/commands/commands.hpp"
#include "sdk/cli/devices/probe.hpp"
#include "sdk/client/library.hpp"
#include "sdk/io/json_text.hpp"
#include "sdk/io/number_checks.hpp"
#include "sdk/io/terminal.hpp"

namespace defrec::cli {
namespace {

using Json = nlohmann::ordered_json;

struct DevicesOptions {
    bool verify = false, json = false;
    double limit_seconds = 20;
    std::string probe;
};

const char* kind_name(unsigned kind) {
    switch (kind) {
        case DEFREC_DEVICE_CPU:
            return "cpu";
        case DEFREC_DEVICE_CUDA:
            return "cuda";
        case DEFREC_DEVICE_VULKAN:
            return "vulkan";
        default:
            return "other";
    }
}

int list_all(const DevicesOptions& options) {
    PluginRemarks remarks;
    const Context context = open_context({1, true, {}, &remarks});
    const std::vector<Device> devices = list_devices(context);
    Json json{{"devices", Json::array()}, {"plugins", Json::array()}};
    std::string text;
    for (const Device& device : devices) {
        json["devices"].push_back({{"id", device.id},
                                   {"kind", kind_name(device.kind)},
                                   {"name", device.name},
                                   {"driver", device.driver},
                                   {"tracks", device.has_every_stage()}});
        text += device.id + ": " + device.name +
                (device.has_every_stage() ? "" : " (not every stage)") + "\n";
    }
    if (devices.empty()) text += "no device\n";
    for (const Plugin& plugin : list_plugins(context)) {
        json["plugins"].push_back({{"name", plugin.name},
                                   {"path", plugin.path},
                                   {"version", plugin.version},
                                   {"loaded", plugin.is_loaded},
                                   {"reason", plugin.reason},
                                   {"remark", remarks[plugin.name]}});
        text += "plugin " + plugin.path + ": " +
                (plugin.is_loaded ? "loaded" : "refused: " + plugin.reason);
        if (plugin.is_loaded && !plugin.reason.empty()) text += ", but " + plugin.reason;
        if (plugin.is_loaded && !remarks[plugin.name].empty()) text += ", " + remarks[plugin.name];
        text += "\n";
    }
    if (json["plugins"].empty())
        text += "no plugin was found, beside the library or in DEFREC_PLUGIN_PATH\n";
    print(options.json ? json_text(json, 2) + "\n" : text);
    return static_cast<int>(devices.empty() ? ExitCode::kDevice : ExitCode::kOk);
}

int verify_all(const DevicesOptions& options) {
    const auto limit =
        std::chrono::milliseconds(static_cast<std::int64_t>(options.limit_seconds * 1000));
    Json json{{"plugins", Json::array()}};
    std::string text;
    bool all_good = true, any_device = false;
    for (const ProbeResult& result : probe_all("/proc/self/exe", limit)) {
        all_good = all_good && result.is_good;
        any_device = any_device || !result.devices.empty();
        json["plugins"].push_back({{"path", result.manifest},
                                   {"good", result.is_good},
                                   {"message", result.message},
                                   {"devices", result.devices}});
        text += result.manifest + ": " + (result.is_good ? "good: " : "REFUSED: ") +
                result.message + "\n";
    }
    if (json["plugins"].empty()) text += "no plugin was found\n";
    print(options.json ? json_text(json, 2) + "\n" : text);
    return static_cast<int>(all_good && any_device ? ExitCode::kOk : ExitCode::kDevice);
}

}  // namespace

CLI::App* add_devices_command(CLI::App& app, std::function<int()>& run) {
    auto options = std::make_shared<DevicesOptions>();
    CLI::App* command =
        app.add_subcommand("devices", "Show what can compute, and why a plugin was refused");
    command->add_flag("--verify", options->verify,
                      "Open each plugin in a process of its own and track one small frame on each "
                      "of its devices");
    command
        ->add_option("--timeout", options->limit_seconds, "Seconds that --verify gives each plugin")
        ->type_name("S")
        ->check(number_in(0.1, 3600.0))
        ->capture_default_str();
    command->add_flag("--json", options->json, "Print JSON");
    command->add_option("--probe", options->probe)->group("");
    command->footer(
        "Plugins lie beside the library; folders and manifests in DEFREC_PLUGIN_PATH are looked at "
        "before. Ids are what\n"
        "--device takes, the part before the colon is what --backend takes.\n"
        "\n"
        "Exit code 5 when there is no device, or with --verify when a plugin is refused, crashes "
        "or hangs.");
    command->callback([options, &run] {
        run = [options] {
            if (!options->probe.empty()) return run_probe(options->probe);
            return options->verify ? verify_all(*options) : list_all(*options);
        };
    });
    return command;
}

}  // namespace defrec::cli
