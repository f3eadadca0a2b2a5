// One or two cameras as a GStreamer pipeline, which ends in an appsink for each.
#include "sdk/input/pipeline.hpp"

#include <gst/app/gstappsink.h>
#include <gst/gst.h>
#include <gst/video/video.h>

#include <atomic>
#include <optional>
#include <utility>

#include "sdk/input/camera_name.hpp"
#include "sdk/io/exit_code.hpp"

namespace defrec::cli {
namespace {

// Latency of the buffer that evens out the network, ms.
constexpr guint kNetworkLatency = 100;

struct Unref {
    void operator()(gpointer object) const { gst_object_unref(object); }
};
template <typename T>
using Ref = std::unique_ptr<T, Unref>;

struct FreeError {
    void operator()(GError* error) const { g_error_free(error); }
};
using ErrorRef = std::unique_ptr<GError, FreeError>;

// Names of the elements of a camera within the pipeline.
std::string element_name(std::size_t camera) { return "camera" + std::to_string(camera); }
std::string sink_name(std::size_t camera) { return "images" + std::to_string(camera); }

std::string head_of(const CameraName& name, std::size_t camera) {
    switch (name.kind) {
        case CameraName::Kind::kRtsp:
            return "rtspsrc name=" + element_name(camera) +
                   " ! application/x-rtp,media=video ! decodebin";
        case CameraName::Kind::kDevice:
            return "v4l2src name=" + element_name(camera) + " ! decodebin";
        default:
            return name.address;
    }
}

std::string description_of(const std::vector<CameraName>& cameras) {
    std::string text;
    for (std::size_t i = 0; i < cameras.size(); ++i) {
        text += head_of(cameras[i], i) +
                " ! videoconvert ! video/x-raw,format=(string){BGR,GRAY8} ! appsink name=" +
                sink_name(i) + " ";
    }
    return text;
}

// Pixels of a sample for as long as they are looked at.
class MappedSample {
  public:
    MappedSample(GstSample* sample, const GstVideoInfo& info) : sample_(sample) {
        is_mapped_ =
            gst_video_frame_map(&frame_, &info, gst_sample_get_buffer(sample), GST_MAP_READ) != 0;
    }
    ~MappedSample() {
        if (is_mapped_) gst_video_frame_unmap(&frame_);
        gst_sample_unref(sample_);
    }
    MappedSample(const MappedSample&) = delete;
    MappedSample& operator=(const MappedSample&) = delete;

    bool is_mapped() const { return is_mapped_; }
    cv::Mat image() const {
        const int type =
            GST_VIDEO_FRAME_FORMAT(&frame_) == GST_VIDEO_FORMAT_GRAY8 ? CV_8UC1 : CV_8UC3;
        return {GST_VIDEO_FRAME_HEIGHT(&frame_), GST_VIDEO_FRAME_WIDTH(&frame_), type,
                GST_VIDEO_FRAME_PLANE_DATA(&frame_, 0),
                static_cast<std::size_t>(GST_VIDEO_FRAME_PLANE_STRIDE(&frame_, 0))};
    }

  private:
    GstSample* sample_;
    GstVideoFrame frame_{};
    bool is_mapped_ = false;
};

// What is made of it ends with a full stop of its own.
std::string reason_of(const GError* error) {
    if (error == nullptr) return "no reason was given";
    std::string text = shown_source(error->message);
    while (text.ends_with('.')) text.pop_back();
    return text;
}

bool lacks_an_element(const GError* error) {
    return error != nullptr && error->domain == GST_PARSE_ERROR &&
           error->code == GST_PARSE_ERROR_NO_SUCH_ELEMENT;
}

// A pipeline is said whole.
[[noreturn]] void fail(const std::string& message) {
    throw CliError(ExitCode::kInput, shown_source(message));
}

void start_gstreamer() {
    GError* error = nullptr;
    if (gst_init_check(nullptr, nullptr, &error) != 0) return;
    const ErrorRef owner(error);
    fail("GStreamer cannot be started: " + reason_of(error) + ".");
}

}  // namespace

struct Pipeline::Impl {
    struct Sink {
        Impl* owner;
        std::size_t camera;
        Ref<GstElement> element;
    };

    Receiver receiver;
    Ref<GstElement> pipeline;
    Ref<GstBus> bus;
    std::vector<std::unique_ptr<Sink>> sinks;
    std::atomic<bool> is_ended{false};

    ~Impl() {
        if (pipeline) gst_element_set_state(pipeline.get(), GST_STATE_NULL);
    }

    void build(const std::vector<CameraName>& cameras) {
        const std::string text = description_of(cameras);
        GError* error = nullptr;
        pipeline.reset(
            gst_parse_launch_full(text.c_str(), nullptr, GST_PARSE_FLAG_FATAL_ERRORS, &error));
        const ErrorRef owner(error);
        if (pipeline) gst_object_ref_sink(pipeline.get());
        if (!pipeline || error != nullptr) {
            fail("GStreamer does not accept this pipeline (" + text + "): " + reason_of(error) +
                 (lacks_an_element(error)
                      ? ". Is a package of GStreamer's plugins missing? Debian's for cameras are "
                        "gstreamer1.0-plugins-base and gstreamer1.0-plugins-good."
                      : "."));
        }
        if (!GST_IS_PIPELINE(pipeline.get())) fail("this is no pipeline: " + text);
        for (std::size_t i = 0; i < cameras.size(); ++i) {
            set_address(cameras[i], i);
            add_sink(i);
        }
        bus.reset(gst_element_get_bus(pipeline.get()));
        // Times go on over restarts, and are the same for all cameras.
        const Ref<GstClock> clock(gst_system_clock_obtain());
        gst_pipeline_use_clock(GST_PIPELINE(pipeline.get()), clock.get());
    }

    void set_address(const CameraName& camera, std::size_t number) const {
        if (camera.kind == CameraName::Kind::kPipeline) return;
        const Ref<GstElement> source(
            gst_bin_get_by_name(GST_BIN(pipeline.get()), element_name(number).c_str()));
        if (camera.kind == CameraName::Kind::kRtsp) {
            g_object_set(source.get(), "location", camera.address.c_str(), "latency",
                         kNetworkLatency, "drop-on-latency", TRUE, nullptr);
        } else {
            g_object_set(source.get(), "device", camera.address.c_str(), nullptr);
        }
    }

    void add_sink(std::size_t number) {
        auto sink = std::make_unique<Sink>();
        sink->owner = this;
        sink->camera = number;
        sink->element.reset(
            gst_bin_get_by_name(GST_BIN(pipeline.get()), sink_name(number).c_str()));
        GstAppSinkCallbacks callbacks{};
        callbacks.eos = [](GstAppSink*, gpointer data) {
            static_cast<Sink*>(data)->owner->is_ended = true;
        };
        callbacks.new_sample = [](GstAppSink* element, gpointer data) {
            const Sink& self = *static_cast<Sink*>(data);
            self.owner->receive(element, self.camera);
            return GST_FLOW_OK;
        };
        gst_app_sink_set_callbacks(GST_APP_SINK(sink->element.get()), &callbacks, sink.get(),
                                   nullptr);
        sinks.push_back(std::move(sink));
    }

    void start() {
        // Cameras deliver at their own pace; what is read from files is held back to its times.
        const bool is_live =
            gst_element_set_state(pipeline.get(), GST_STATE_PAUSED) == GST_STATE_CHANGE_NO_PREROLL;
        for (const auto& sink : sinks) {
            g_object_set(sink->element.get(), "sync", is_live ? FALSE : TRUE, "max-buffers", 1U,
                         "drop", TRUE, nullptr);
        }
        gst_element_set_state(pipeline.get(), GST_STATE_PLAYING);
    }

    // nullopt: the camera gave the image no time.
    std::optional<double> time_of(GstSample* sample) const {
        const GstBuffer* buffer = gst_sample_get_buffer(sample);
        const GstSegment* segment = gst_sample_get_segment(sample);
        if (buffer == nullptr || segment == nullptr || !GST_BUFFER_PTS_IS_VALID(buffer))
            return std::nullopt;
        const GstClockTime running =
            gst_segment_to_running_time(segment, GST_FORMAT_TIME, GST_BUFFER_PTS(buffer));
        if (!GST_CLOCK_TIME_IS_VALID(running)) return std::nullopt;
        return static_cast<double>(gst_element_get_base_time(pipeline.get()) + running) * 1e-6;
    }

    void receive(GstAppSink* element, std::size_t camera) {
        GstSample* sample = gst_app_sink_pull_sample(element);
        if (sample == nullptr) return;
        GstVideoInfo info;
        const GstCaps* caps = gst_sample_get_caps(sample);
        const std::optional<double> time = time_of(sample);
        if (caps == nullptr || !time || gst_video_info_from_caps(&info, caps) == 0) {
            gst_sample_unref(sample);
            return;
        }
        const auto mapped = std::make_shared<const MappedSample>(sample, info);
        if (!mapped->is_mapped()) return;
        const double fps =
            info.fps_d > 0 ? static_cast<double>(info.fps_n) / static_cast<double>(info.fps_d) : 0;
        receiver(camera, {{mapped->image(), *time, mapped}, fps});
    }
};

Pipeline::Pipeline(const std::vector<std::string>& cameras, Receiver receiver)
    : impl_(std::make_unique<Impl>()) {
    start_gstreamer();
    std::vector<CameraName> names;
    names.reserve(cameras.size());
    for (const std::string& camera : cameras) names.push_back(parse_camera(camera));
    impl_->receiver = std::move(receiver);
    impl_->build(names);
    impl_->start();
}

Pipeline::~Pipeline() = default;

std::string Pipeline::take_error() {
    GstMessage* message = gst_bus_pop_filtered(impl_->bus.get(), GST_MESSAGE_ERROR);
    if (message == nullptr) return "";
    GError* error = nullptr;
    gst_message_parse_error(message, &error, nullptr);
    const ErrorRef owner(error);
    gst_message_unref(message);
    return reason_of(error);
}

bool Pipeline::has_ended() const { return impl_->is_ended; }

}  // namespace defrec::cli
