// `defrec evaluate`.
#include "sdk/evaluation/evaluate.hpp"

#include <fnmatch.h>
#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <filesystem>
#include <list>
#include <map>
#include <memory>
#include <nlohmann/json.hpp>
#include <set>
#include <thread>

#include "sdk/base/os/atomic_file.hpp"
#include "sdk/client/library.hpp"
#include "sdk/client/tracker_config.hpp"
#include "sdk/evaluation/clip_inputs.hpp"
#include "sdk/evaluation/clip_process.hpp"
#include "sdk/evaluation/clip_store.hpp"
#include "sdk/evaluation/result_files.hpp"
#include "sdk/evaluation/results.hpp"
#include "sdk/io/counted.hpp"
#include "sdk/io/interrupt.hpp"
#include "sdk/io/json_text.hpp"
#include "sdk/io/output_folder.hpp"
#include "sdk/io/terminal.hpp"
#include "sdk/io/text.hpp"

namespace defrec::cli {
namespace {

namespace fs = std::filesystem;
using Clock = std::chrono::steady_clock;

constexpr std::size_t kLargestPredictions = 1'000'000'000;

// One set of parameters with which every clip is run.
struct Variant {
    std::string name;
    RunSettings settings;
    std::string description;  // of everything on which its results depend
};

const char* name_of(LengthUnit units) {
    switch (units) {
        case LengthUnit::kMillimetre:
            return "mm";
        case LengthUnit::kMetre:
            return "m";
        case LengthUnit::kGuarded:
            break;
    }
    return "";
}

const char* name_of(Method method) {
    switch (method) {
        case Method::kOpenCv:
            return "opencv";
        case Method::kStill:
            return "still";
        case Method::kDefrec:
            break;
    }
    return "defrec";
}

std::string description_of(const DataSet& data_set, const RunSettings& settings) {
    constexpr std::size_t kLargestConfig = 1'000'000;
    nlohmann::ordered_json json = {
        {"defrec", defrec_version_string()},  {"data_set", data_set.name()},
        {"method", name_of(settings.method)}, {"backend", settings.backend},
        {"device", settings.device},          {"seed", settings.seed},
        {"units", name_of(settings.units)},   {"video", settings.video}};
    json["config"] = settings.config.empty()
                         ? ""
                         : read_text_file(settings.config, kLargestConfig, ExitCode::kUsage);
    return json_text(json);
}

std::vector<Variant> variants_of(const EvaluateOptions& options, const DataSet& data_set) {
    std::vector<Variant> variants;
    std::set<std::string> names;
    const auto add = [&](const std::string& name, Method method, const std::string& config) {
        if (!names.insert(name).second) {
            throw CliError(ExitCode::kUsage, "--config, --method: two variants are called " + name +
                                                 "; their names tell them apart.");
        }
        Variant variant{name, options.settings, {}};
        variant.settings.method = method;
        variant.settings.config = config;
        variant.description = description_of(data_set, variant.settings);
        variants.push_back(std::move(variant));
    };
    for (const Method method : options.methods) {
        if (method != Method::kDefrec || options.configs.empty()) {
            add(name_of(method), method, "");
            continue;
        }
        for (const std::string& config : options.configs) {
            auto desc = initialised<defrec_tracker_desc>();
            read_config(config, desc);
            add(fs::path(config).stem().string(), method, config);
        }
    }
    return variants;
}

std::vector<std::string> chosen_clips(const EvaluateOptions& options, const DataSet& data_set) {
    std::vector<std::string> all = clips_of(data_set, options.root), chosen;
    if (options.subset.empty()) return all;
    std::vector<bool> is_used(options.subset.size());
    for (std::string& clip : all) {
        bool matches = false;
        for (std::size_t i = 0; i < options.subset.size(); ++i) {
            if (::fnmatch(options.subset[i].c_str(), clip.c_str(), 0) != 0) continue;
            matches = is_used[i] = true;
        }
        if (matches) chosen.push_back(std::move(clip));
    }
    for (std::size_t i = 0; i < is_used.size(); ++i) {
        if (is_used[i]) continue;
        throw CliError(ExitCode::kUsage, "--subset: no clip matches '" + options.subset[i] +
                                             "'; --list names the clips.");
    }
    return chosen;
}

fs::path folder_of_clip(const fs::path& root, const std::string& clip) {
    return (root / clip).lexically_normal();
}

// The clips that this process runs, one after the other or some at a time.
class Evaluation {
  public:
    Evaluation(const EvaluateOptions& options, const DataSet& data_set)
        : options_(options),
          data_set_(data_set),
          clips_(chosen_clips(options, data_set)),
          variants_(variants_of(options, data_set)),
          store_(options.out) {}

    void list() const {
        std::string text;
        for (std::size_t i = 0; i < clips_.size(); ++i)
            if (is_mine(i)) text += clips_[i] + "\n";
        print(text);
    }

    // False when interrupted.
    bool run() {
        create_output_folder(options_.out);
        queue();
        check_result_files(options_.out);
        say_what_is_replaced();
        remove_result_files(options_.out);
        ProgressBar progress(options_.quiet);
        const auto total = static_cast<std::int64_t>(waiting_.size());
        std::int64_t done = 0;
        while (!waiting_.empty() || !running_.empty()) {
            if (interrupt_requested()) return false;
            while (!waiting_.empty() && running_.size() < std::max(1U, options_.jobs)) {
                start(waiting_.front());
                waiting_.pop_front();
            }
            for (auto clip = running_.begin(); clip != running_.end();) {
                const auto failure = clip->process->result();
                if (!failure) {
                    ++clip;
                    continue;
                }
                finish(*clip, *failure);
                progress.update(++done, total, clip->name.clip);
                clip = running_.erase(clip);
            }
            std::this_thread::sleep_for(std::chrono::milliseconds(10));
        }
        return true;
    }

    int merge() {
        Results results{
            data_set_.name(), options_.root, data_set_.metrics(), {}, data_set_.depth_metrics()};
        find_doubts();
        for (const Variant& variant : variants_) results.variants.push_back(results_of(variant));
        check_result_files(options_.out);
        remove_result_files(options_.out);
        write_tables(results);
        for (const VariantResults& variant : results.variants)
            for (const std::string& file : data_set_.prediction_files())
                join_predictions(variant, file);
        if (!options_.quiet) {
            print(results_text(results) +
                  "page: " + (fs::path(options_.out) / "evaluation.html").string() + "\n");
        }
        return say_what_does_not_count(results);
    }

  private:
    struct Waiting {
        ClipName name;
        const Variant* variant;
    };
    struct Running {
        ClipName name;
        const Variant* variant;
        fs::path folder;
        Clock::time_point start;
        std::unique_ptr<ClipProcess> process;
    };

    void write_tables(const Results& results) const {
        const fs::path out(options_.out);
        write_atomically(out / "results.csv", results_csv(results));
        write_atomically(out / "summary.csv", summary_csv(results));
        if (results.has_depths()) {
            write_atomically(out / "results_by_depth.csv", results_by_depth_csv(results));
            write_atomically(out / "summary_by_depth.csv", summary_by_depth_csv(results));
        }
        write_atomically(out / "times.csv", times_csv(results));
        if (variants_.size() > 1) write_atomically(out / "effects.csv", effects_csv(results));
        write_atomically(out / "evaluation.html", results_page(results));
    }

    // Returns the exit code.
    static int say_what_does_not_count(const Results& results) {
        constexpr std::size_t kMostNamed = 5;
        std::size_t quarantined = 0, doubtful = 0;
        for (const VariantResults& variant : results.variants) {
            quarantined += variant.quarantined();
            for (const ClipResult& clip : variant.clips) {
                if (clip.outcome.doubt.empty() || ++doubtful > kMostNamed) continue;
                print_notice("doubtful: " + clip.clip + " (" + variant.variant +
                             "): " + printable(clip.outcome.doubt));
            }
        }
        if (doubtful > 0)
            print_notice(counted(doubtful, "result") + (doubtful == 1 ? " is" : " are") +
                         " doubtful and in no summary; results.csv and the page have the reasons.");
        if (quarantined > 0)
            print_notice(counted(quarantined, "clip") + (quarantined == 1 ? " is" : " are") +
                         " in quarantine; results.csv and the page have the reasons.");
        return static_cast<int>(quarantined + doubtful == 0 ? ExitCode::kOk
                                                            : ExitCode::kBelowThreshold);
    }

    void say_what_is_replaced() const {
        const auto replaced = static_cast<std::size_t>(
            std::count_if(waiting_.begin(), waiting_.end(), [&](const Waiting& clip) {
                std::error_code error;
                return fs::exists(store_.folder(clip.name), error);
            }));
        if (replaced == 0 || options_.resume || options_.quiet) return;
        print_notice(options_.out + ": " + counted(replaced, "result") +
                     " of an earlier evaluation " + (replaced == 1 ? "is" : "are") +
                     " replaced; --resume keeps those of the same options and data.");
    }

    // Baselines state no expected errors, by which a truth of something else shows.
    void find_doubts() {
        for (const Variant& variant : variants_) {
            if (variant.settings.method != Method::kDefrec) continue;
            for (const std::string& clip : clips_)
                if (const auto outcome = outcome_of({variant.name, clip}, variant); outcome)
                    if (std::string& doubt = doubts_[clip]; doubt.empty()) doubt = outcome->doubt;
        }
    }

    bool is_mine(std::size_t clip) const {
        return clip % options_.shard.count == options_.shard.number - 1;
    }

    void queue() {
        for (const Variant& variant : variants_) {
            for (std::size_t i = 0; i < clips_.size(); ++i) {
                const ClipName name{variant.name, clips_[i]};
                if (!is_mine(i)) continue;
                if (options_.resume && is_done(name, variant)) continue;
                waiting_.push_back({name, &variant});
            }
        }
    }

    // As the clip is now, or was when this was asked first.
    const std::string& inputs_of(const std::string& clip) {
        const auto [known, is_new] = inputs_.try_emplace(clip);
        if (is_new)
            known->second = digest_of_inputs(
                data_set_.inputs_of(folder_of_clip(options_.root, clip)), options_.out);
        return known->second;
    }

    // A result by the variant's settings of the clip as it is now; nothing where there is none.
    std::optional<Outcome> outcome_of(const ClipName& name, const Variant& variant) {
        auto outcome = store_.outcome(name);
        if (outcome && outcome->settings == variant.description &&
            outcome->inputs == inputs_of(name.clip))
            return outcome;
        return std::nullopt;
    }

    bool is_done(const ClipName& name, const Variant& variant) {
        const auto outcome = outcome_of(name, variant);
        return outcome && outcome->failure.empty();
    }

    void start(const Waiting& clip) {
        const fs::path folder = store_.begin(clip.name);
        inputs_of(clip.name.clip);  // before they are read
        const RunSettings& settings = clip.variant->settings;
        std::vector<std::string> arguments{fs::read_symlink("/proc/self/exe").string(),
                                           "evaluate",
                                           options_.root,
                                           "--dataset",
                                           data_set_.name(),
                                           "--out",
                                           folder.string(),
                                           "--clip",
                                           clip.name.clip,
                                           "--method",
                                           name_of(settings.method),
                                           "--backend",
                                           settings.backend,
                                           "--threads",
                                           std::to_string(settings.threads),
                                           "--seed",
                                           std::to_string(settings.seed)};
        const auto add = [&](const char* name, const std::string& value) {
            if (!value.empty()) arguments.insert(arguments.end(), {name, value});
        };
        add("--device", settings.device);
        add("--config", settings.config);
        add("--video", settings.video);
        add("--units", name_of(settings.units));
        running_.push_back(
            {clip.name, clip.variant, folder, Clock::now(),
             std::make_unique<ClipProcess>(arguments, folder / "log.txt",
                                           std::chrono::duration<double>(options_.time_limit_s))});
    }

    // The name of the folder during the run is nobody's business.
    static std::string without_folder(std::string message, const fs::path& folder) {
        const std::string prefix = folder.string() + "/";
        for (std::size_t at = message.find(prefix); at != std::string::npos;
             at = message.find(prefix))
            message.erase(at, prefix.size());
        return message;
    }

    void finish(const Running& clip, const std::string& failure) {
        Outcome outcome;
        outcome.failure = without_folder(failure, clip.folder);
        outcome.settings = clip.variant->description;
        outcome.inputs = inputs_of(clip.name.clip);
        outcome.seconds = std::chrono::duration<double>(Clock::now() - clip.start).count();
        store_.commit(clip.name, outcome);
    }

    VariantResults results_of(const Variant& variant) {
        VariantResults results{variant.name, {}, {}};
        Samples all(data_set_.sample_columns());
        std::vector<std::string> missing;
        for (const std::string& clip : clips_) {
            const ClipName name{variant.name, clip};
            auto outcome = outcome_of(name, variant);
            if (!outcome) {
                missing.push_back(clip);
                continue;
            }
            if (variant.settings.method != Method::kDefrec && outcome->counts())
                outcome->doubt = doubts_[clip];
            ClipResult result{clip, *outcome, {}, store_.folder(name)};
            if (outcome->is_done()) {
                Samples samples(data_set_.sample_columns());
                samples.read(result.folder / kSamplesFile);
                result.values = data_set_.summarise(samples);
                result.depths = data_set_.by_depth(samples);
                if (outcome->counts()) all.append(samples);
            }
            results.clips.push_back(std::move(result));
        }
        if (!missing.empty()) {
            throw CliError(
                ExitCode::kInput,
                options_.out + ": " + std::to_string(missing.size()) + " of " +
                    std::to_string(clips_.size()) + " clips of variant " + variant.name +
                    " have not been run with these options and this data, the first is " +
                    missing.front() + "; run the rest with --resume.");
        }
        const bool any_counts = results.quarantined() + results.doubtful() < results.clips.size();
        results.pooled = any_counts ? data_set_.summarise(all)
                                    : std::vector<double>(data_set_.metrics().size(), NAN);
        results.depths = data_set_.by_depth(all);
        return results;
    }

    // predictions/a/b.json of a variant: predictions/a/<variant>/b.json.
    void join_predictions(const VariantResults& variant, const fs::path& file) const {
        nlohmann::ordered_json joined = nlohmann::ordered_json::object();
        for (const ClipResult& clip : variant.clips) {
            if (!clip.outcome.failure.empty()) continue;
            joined.update(nlohmann::ordered_json::parse(
                read_text_file(clip.folder / file, kLargestPredictions, ExitCode::kInput)));
        }
        const fs::path folder =
            fs::path(options_.out) / "predictions" / file.parent_path() / variant.variant;
        create_output_folder(folder);
        write_atomically(folder / file.filename(), json_text(joined) + "\n");
    }

    const EvaluateOptions& options_;
    const DataSet& data_set_;
    std::vector<std::string> clips_;
    std::vector<Variant> variants_;
    ClipStore store_;
    std::map<std::string, std::string> inputs_;  // of clips, as inputs_of() found them
    std::map<std::string, std::string> doubts_;  // of clips, by their truth
    std::list<Waiting> waiting_;
    std::list<Running> running_;
};

int run_clip(const EvaluateOptions& options, const DataSet& data_set) {
    ClipTask task{folder_of_clip(options.root, options.clip), options.out, options.settings};
    task.settings.method = options.methods.front();
    if (!options.configs.empty()) task.settings.config = options.configs.front();
    write_score(task.out, data_set.run(task));
    return static_cast<int>(ExitCode::kOk);
}

}  // namespace

Shard parse_shard(const std::string& text) {
    const std::vector<std::string_view> parts = split(text, '/');
    const auto number = parse_integer(parts.front());
    const auto count = parse_integer(parts.back());
    if (parts.size() != 2 || !number || !count || *number < 1 || *count < *number) {
        throw CliError(
            ExitCode::kUsage,
            "--shard: '" + text + "' was given; 1/4 to 4/4, for example, were expected.");
    }
    return {static_cast<std::size_t>(*number), static_cast<std::size_t>(*count)};
}

int run_evaluate(const EvaluateOptions& options) {
    const DataSet& data_set = data_set_of(options.data_set);
    if (options.settings.units != LengthUnit::kGuarded && !data_set.has_units())
        throw CliError(ExitCode::kUsage,
                       "--units: data set " + data_set.name() + " fixes the unit.");
    if (!options.clip.empty()) return run_clip(options, data_set);
    Evaluation evaluation(options, data_set);
    if (options.list) {
        evaluation.list();
        return static_cast<int>(ExitCode::kOk);
    }
    if (!options.merge && !evaluation.run()) return static_cast<int>(ExitCode::kInterrupted);
    return options.is_sharded ? static_cast<int>(ExitCode::kOk) : evaluation.merge();
}

}  // namespace defrec::cli
