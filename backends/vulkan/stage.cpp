// See stage.hpp.
#include "backends/vulkan/stage.hpp"

#include <algorithm>

namespace defrec::vulkan {
namespace {

constexpr size_t kMostRuns = 8;  // a tracker needs two or three; an application that runs a stage by itself, one

// Any address that is not NULL tells that the buffer was given.
template <class View>
std::vector<View> views(Buffers buffers) {
    std::vector<View> result;
    for (const Buffer* buffer : buffers)
        result.push_back(buffer == nullptr ? View{} : View{const_cast<Buffer*>(buffer), buffer->size()});
    return result;
}

}  // namespace

void check_size(const char* stage, const char* what, uint64_t size, uint64_t most) {
    if (size > most)
        throw StageError(DEFREC_ERROR_UNSUPPORTED, std::string(stage) + ": " + std::to_string(size) + " " + what +
                                                       "; this device takes at most " + std::to_string(most));
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

RecordedStage::Serials RecordedStage::serials(Buffers in, Buffers out) {
    if (std::max(in.size(), out.size()) > kMaxBuffers) throw StageError(DEFREC_ERROR_ARGUMENT, "too many buffers");
    Serials result{};
    for (size_t i = 0; i < in.size(); ++i) result[i] = in[i] == nullptr ? 0 : in[i]->serial();
    for (size_t i = 0; i < out.size(); ++i) result[kMaxBuffers + i] = out[i] == nullptr ? 0 : out[i]->serial();
    return result;
}

void RecordedStage::enqueue(Queue& queue, Buffers in, Buffers out) {
    const std::lock_guard lock(mutex_);
    const Serials wanted = serials(in, out);
    auto run = std::find_if(runs_.begin(), runs_.end(), [&](const Run& known) {
        return known.buffers == wanted && known.in_count == in.size() && known.out_count == out.size();
    });
    if (run == runs_.end()) {
        if (runs_.size() == kMostRuns) {
            device_.settle();
            runs_.pop_back();
        }
        std::list<Run> added;
        Run& made = added.emplace_back(wanted, in.size(), out.size(), device_);
        Recorder recorder(made.recording);
        stage_->record(recorder, in, out);
        recorder.finish();
        runs_.splice(runs_.begin(), added);
    } else {
        runs_.splice(runs_.begin(), runs_, run);
    }
    queue.run(runs_.front().recording.commands());
}

}  // namespace defrec::vulkan
