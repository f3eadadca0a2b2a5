// See recorded_stage.hpp.
#include "backends/cuda/gpu/recorded_stage.hpp"

#include <algorithm>

namespace defrec::cuda {
namespace {

constexpr size_t kMaxRuns =
    64;  // both views, a tracker's two sets of buffers and an application's ring of memory combine

template <class View>
std::vector<View> views(Buffers buffers) {
    std::vector<View> result;
    for (const Buffer* buffer : buffers)
        result.push_back(buffer == nullptr ? View{} : View{buffer->data(), buffer->size()});
    return result;
}

}  // namespace

RecordedStage::RecordedStage(Gpu& gpu, std::unique_ptr<Stage> stage)
    : gpu_(gpu), stage_(std::move(stage)), serial_(next_serial()) {}

void RecordedStage::prepare(Queue& queue, Buffers in) {
    const HostCopies given(queue, in);
    const std::lock_guard lock(mutex_);
    gpu_.settle();
    runs_.clear();
    stage_->prepare(given.views());
}

void RecordedStage::enqueue(Queue& queue, Buffers in, Buffers out) {
    const std::lock_guard lock(mutex_);
    const auto* known = runs_.find(in, out);
    if (known == nullptr) {
        auto run = std::make_shared<StageRun>();
        run->serial = next_serial();
        run->stage = stage_->reentrant() ? 0 : serial_;
        run->reads = views<MemoryRange>(in);
        run->writes = views<MemoryRange>(out);
        Recorder recorder(run->recording);
        {
            const Gpu::Use use(gpu_);
            stage_->record(recorder, views<InBuffer>(in), views<OutBuffer>(out));
        }
        const auto& nodes = run->recording.nodes;
        if (stage_->reentrant() && std::any_of(nodes.begin(), nodes.end(), [](const Node& node) {
                return !node.early.empty();
            }))
            throw StageError(DEFREC_ERROR_INTERNAL, "a stage that is reentrant begins early");
        if (runs_.size() == kMaxRuns) runs_.drop_last();
        known = &runs_.add(in, out, std::move(run));
    }
    queue.run(*known);
}

}  // namespace defrec::cuda
