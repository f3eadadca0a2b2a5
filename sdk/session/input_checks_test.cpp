// The checks of a run, against what the doctor says of the same frames.
#include "sdk/session/input_checks.hpp"

#include <doctest/doctest.h>

#include <chrono>
#include <future>
#include <memory>
#include <nlohmann/json.hpp>
#include <utility>
#include <vector>

#include "sdk/client/library.hpp"
#include "sdk/doctor/doctor.hpp"
#include "sdk/io/test_folder.hpp"
#include "sdk/scenes/writing/render_command.hpp"

using namespace defrec::cli;

namespace {

constexpr int kWidth = 960, kHeight = 544, kFrames = 22;  // as many are looked at

const TestFolder& sequence() {
    static const TestFolder folder;
    static const bool is_rendered = [] {
        RenderOptions options;
        options.scene = "heartbeat";
        options.out_dir = folder.path().string();
        options.width = kWidth;
        options.height = kHeight;
        options.frames = kFrames + 2;
        render_sequence(options, {});
        return true;
    }();
    static_cast<void>(is_rendered);
    return folder;
}

DoctorOptions options_of(const char* left, const char* right) {
    DoctorOptions options;
    options.source.left = (sequence().path() / left).string();
    options.source.right = (sequence().path() / right).string();
    options.calibration = (sequence().path() / "calibration.yaml").string();
    options.probe.backend = "cpu";
    return options;
}

// A run of `defrec track` as far as the checks see it.
class Run {
  public:
    explicit Run(const DoctorOptions& options)
        : source_(options.source),
          context_(open_context({0, true, {}})),
          device_(choose_device(context_, "cpu", "")),
          rig_(make_rig(context_, load_calibration(options.calibration))),
          checks_(std::make_unique<InputChecks>(
              read_calibration(written_calibration(options.calibration)), rig_info(rig_).camera,
              [this](std::string text) { shown_.set_value(std::move(text)); })) {
        auto desc = initialised<defrec_tracker_desc>();
        desc.format = format_of_channels(source_.channels());
        desc.device_id = device_.id.c_str();
        desc.body = DEFREC_BODY_OFF;
        desc.keep_disparity = 1;
        defrec_tracker handle = nullptr;
        REQUIRE(defrec_tracker_create(context_.get(), rig_.get(), &desc, &handle) == DEFREC_OK);
        tracker_.reset(handle);
    }

    void track(int frames) {
        StereoFrame frame;
        for (int i = 0; i < frames; ++i) {
            REQUIRE(source_.next(frame));
            const Job job = submit(tracker_, frame);
            const defrec_result result = result_of(job, frame.index);
            compression_.add(frame, result);
            checks_->add(frame, result, compression_);
        }
    }
    std::future<std::string> shown() { return shown_.get_future(); }
    void end() { checks_.reset(); }

  private:
    FrameSource source_;
    Context context_;
    Device device_;
    Rig rig_;
    Tracker tracker_;
    CompressionWatch compression_;
    std::promise<std::string> shown_;
    std::unique_ptr<InputChecks> checks_;
};

std::string shown_of(const DoctorOptions& options) {
    Run run(options);
    auto shown = run.shown();
    run.track(kFrames + 2);
    return shown.get();
}

}  // namespace

TEST_CASE("a run says what the doctor says of the same frames, word for word") {
    const std::pair<const char*, const char*> orders[] = {{"left", "right"}, {"right", "left"}};
    for (const auto& [left, right] : orders) {
        CAPTURE(left);
        const DoctorOptions options = options_of(left, right);
        const std::string shown = shown_of(options);
        CHECK(shown == diagnosis_json(diagnose(options)));
        const auto json = nlohmann::json::parse(shown);
        CHECK(json["frames"] == kFrames);
        CHECK(json["found"] == (options.source.left.ends_with("left") ? 0 : 1));
    }
}

TEST_CASE("a run that ends before is not held up, and shows nothing") {
    Run run(options_of("left", "right"));
    auto shown = run.shown();
    run.track(kFrames - 1);
    run.end();
    CHECK(shown.wait_for(std::chrono::seconds(0)) == std::future_status::timeout);
}

TEST_CASE("checks that fail are shown as unknown, with the reason") {
    std::promise<std::string> promise;
    InputChecks checks({}, {}, [&](std::string text) { promise.set_value(std::move(text)); });
    // A view without pixels cannot be matched.
    StereoFrame frame;
    frame.left = {nullptr, 1920, 1080, 1, 1920};
    const std::vector<std::uint8_t> pixels(1920 * 1080);
    frame.left.pixels = pixels.data();
    frame.right = {pixels.data(), 0, 0, 1, 0};
    const auto result = initialised<defrec_result>();
    for (int i = 0; i < 12; ++i) checks.add(frame, result, {});
    const auto json = nlohmann::json::parse(promise.get_future().get());
    REQUIRE(json["findings"].size() == 1);
    CHECK(json["findings"][0]["verdict"] == "unknown");
    const auto what = json["findings"][0]["what"].get<std::string>();
    CHECK_MESSAGE(what.find("they broke off: ") == 0, what);
}
