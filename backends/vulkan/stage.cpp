// See stage.hpp.
#include "backends/vulkan/stage.hpp"

namespace defrec::vulkan {
namespace {

constexpr size_t kMaxRuns =
    8;  // a tracker needs two or three; an application that runs a stage by itself, one

// Any address that is not NULL tells that the buffer was given.
template <class View>
std::vector<View> views(Buffers buffers) {
    std::vector<View> result;
    for (const Buffer* buffer : buffers)
        result.push_back(buffer == nullptr ? View{}
                                           : View{const_cast<Buffer*>(buffer), buffer->size()});
    return result;
}

}  // namespace

void check_size(const char* stage, const char* what, uint64_t size, uint64_t maximum) {
    if (size > maximum)
        throw StageError(DEFREC_ERROR_UNSUPPORTED,
                         std::string(stage) + ": " + std::to_string(size) + " " + what +
                             "; this device takes at most " + std::to_string(maximum));
}

std::vector<InBuffer> sizes_of_inputs(Buffers in) { return views<InBuffer>(in); }
std::vector<OutBuffer> sizes_of_outputs(Buffers out) { return views<OutBuffer>(out); }

void RecordedStage::prepare(Queue& queue, Buffers in) {
    const HostCopies given(queue, in);
    const std::lock_guard lock(mutex_);
    device_.settle();
    runs_.clear();
    stage_->prepare(given.views());
}

void RecordedStage::enqueue(Queue& queue, Buffers in, Buffers out) {
    const std::lock_guard lock(mutex_);
    const auto* known = runs_.find(in, out);
    if (known == nullptr) {
        if (runs_.size() == kMaxRuns) {
            device_.settle();
            runs_.drop_last();
        }
        auto recording = std::make_unique<Recording>(device_);
        Recorder recorder(*recording);
        stage_->record(recorder, in, out);
        recorder.finish();
        known = &runs_.add(in, out, std::move(recording));
    }
    queue.run(**known);
}

}  // namespace defrec::vulkan
