// See compare.hpp.
#include "sdk/cli/bench/compare.hpp"

#include <algorithm>
#include <cmath>

#include "sdk/io/json_text.hpp"
#include "sdk/io/text.hpp"

namespace defrec::cli {
namespace {

using Json = nlohmann::ordered_json;

constexpr std::size_t kMaxFileBytes = 1 << 20;
constexpr char kAllStages[] = "all stages", kSubmitToResult[] = "submit to result";

// A number of an object, where it has that.
std::optional<double> number(const Json& object, const char* name) {
    const auto at = object.find(name);
    return at != object.end() && at->is_number() ? std::optional(at->get<double>()) : std::nullopt;
}

struct NamedTime {
    std::string name;
    Json time;
};

// Names and times of a run, the whole frame last.
std::vector<NamedTime> times_of(const Json& run) {
    std::vector<NamedTime> times;
    for (const auto& [name, time] : run["stages"].items())
        times.push_back({name == "frame" ? kAllStages : name, time});
    if (run.contains("submit_to_result"))
        times.push_back({kSubmitToResult, run["submit_to_result"]});
    return times;
}

std::string column(const std::string& text) {
    return std::string(text.size() < 11 ? 11 - text.size() : 0, ' ') + text;
}
std::string column(std::optional<double> ms) { return column(ms ? format_fixed(*ms, 2) : "-"); }

}  // namespace

double difference_noise(double recorded, double present) {
    return 2 * std::sqrt(recorded * recorded + present * present);
}

Json read_recorded_run(const std::filesystem::path& path) {
    const std::string text = read_text_file(path, kMaxFileBytes, ExitCode::kInput);
    Json run = Json::parse(text, nullptr, false);
    const auto is_time = [](const Json& time) {
        return time.is_object() && number(time, "median_ms") && number(time, "noise_ms");
    };
    const auto is_run = [&](const Json& json) {
        if (!json.is_object() || !json.contains("stages") || !json["stages"].is_object())
            return false;
        const auto times = times_of(json);
        return std::all_of(times.begin(), times.end(),
                           [&](const NamedTime& named) { return is_time(named.time); });
    };
    if (!is_run(run))
        throw CliError(ExitCode::kInput,
                       path.string() + " is not what `defrec bench --json` prints.");
    return run;
}

void check_comparable(const Json& recorded, const Json& present) {
    for (const char* name : {"size", "sequence"})
        if (recorded.value(name, Json()) != present.value(name, Json()))
            throw CliError(ExitCode::kUsage, "--compare: the recorded run has " +
                                                 std::string(name) + " " +
                                                 json_text(recorded.value(name, Json())) +
                                                 ", this one " + json_text(present[name]) + ".");
}

std::vector<ComparedTime> compare_runs(const Json& recorded, const Json& present, double limit) {
    std::vector<ComparedTime> times;
    const auto before = times_of(recorded);
    for (const NamedTime& now : times_of(present)) {
        const auto at = std::find_if(before.begin(), before.end(), [&](const NamedTime& other) {
            return other.name == now.name;
        });
        ComparedTime compared{now.name, std::nullopt, number(now.time, "median_ms")};
        if (at != before.end()) {
            compared.recorded = number(at->time, "median_ms");
            compared.noise = difference_noise(at->time["noise_ms"], now.time["noise_ms"]);
            const double slower = compared.present.value_or(0) - compared.recorded.value_or(0);
            compared.is_beyond = slower > limit * compared.recorded.value_or(0) + compared.noise;
        }
        times.push_back(std::move(compared));
    }
    for (const NamedTime& gone : before) {
        const bool is_known =
            std::any_of(times.begin(), times.end(),
                        [&](const ComparedTime& other) { return other.name == gone.name; });
        if (!is_known) times.push_back({gone.name, number(gone.time, "median_ms"), std::nullopt});
    }
    return times;
}

bool any_beyond(const std::vector<ComparedTime>& times) {
    return std::any_of(times.begin(), times.end(),
                       [](const ComparedTime& time) { return time.is_beyond; });
}

std::string comparison_text(const std::vector<ComparedTime>& times, double limit) {
    std::string text = "median, ms            recorded        now     change      noise\n";
    for (const ComparedTime& time : times) {
        std::string name = time.name;
        name.resize(std::max<std::size_t>(name.size(), 19), ' ');
        text += name + column(time.recorded) + column(time.present);
        if (time.recorded && time.present) {
            const double change = *time.present - *time.recorded;
            const std::string percent = *time.recorded > 0
                                            ? format_fixed(100 * change / *time.recorded, 1) + " %"
                                            : std::string("-");
            text += column((change > 0 && *time.recorded > 0 ? "+" : "") + percent) +
                    column(format_fixed(time.noise, 2));
            if (time.is_beyond) text += "  slower";
        }
        text += '\n';
    }
    return text + (any_beyond(times) ? "Slower by more than " : "Nothing is slower by more than ") +
           format_fixed(100 * limit, 0) + " % and the noise.\n";
}

Json comparison_json(const std::vector<ComparedTime>& times) {
    Json json = Json::object();
    for (const ComparedTime& time : times) {
        Json& entry = json[time.name] = Json::object();
        if (time.recorded) entry["recorded_ms"] = *time.recorded;
        if (time.present) entry["present_ms"] = *time.present;
        entry["noise_ms"] = time.noise;
        entry["slower"] = time.is_beyond;
    }
    return json;
}

}  // namespace defrec::cli
