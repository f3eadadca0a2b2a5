// See test_device.hpp.
#include "backends/cuda/gpu/test_device.hpp"

#include <doctest/doctest.h>

#include <optional>

#include "backends/cuda/gpu/recorded_stage.hpp"

namespace defrec::under_test {
namespace {

// The stage with device buffers of its own, which live from call to call as those of a tracker do.
class InHostMemory final : public Stage {
  public:
    explicit InHostMemory(std::unique_ptr<cuda::Stage> stage) : queue_(device()), stage_(device(), std::move(stage)) {}
    ~InHostMemory() override { device().settle(); }

    void prepare(std::span<const InBuffer> in) override {
        upload(prepared_, in);
        stage_.prepare(queue_, pointers(prepared_));
    }
    void run(std::span<const InBuffer> in, std::span<const OutBuffer> out) override {
        upload(in_, in);
        upload(out_, out);
        stage_.enqueue(queue_, pointers(in_), pointers(out_));
        for (size_t i = 0; i < out.size(); ++i)
            if (out_[i]) queue_.read(*out_[i], 0, out[i].data, out[i].size);
        queue_.wait(queue_.signal(), UINT64_MAX);
    }

  private:
    using Owned = std::vector<std::optional<cuda::Buffer>>;
    template <class HostBuffer>
    void upload(Owned& buffers, std::span<const HostBuffer> from) {
        buffers.resize(from.size());
        for (size_t i = 0; i < from.size(); ++i) {
            const bool given = from[i].data != nullptr || from[i].size != 0;
            if (buffers[i] && !(given && buffers[i]->size() == from[i].size)) {
                device().settle();  // a run that was refused has left work in the queue
                buffers[i].reset();
            }
            if (!given) continue;
            if (!buffers[i]) buffers[i].emplace(device(), from[i].size);
            queue_.write(*buffers[i], 0, from[i].data, from[i].size);
        }
    }
    static std::vector<const cuda::Buffer*> pointers(const Owned& buffers) {
        std::vector<const cuda::Buffer*> result;
        for (const auto& buffer : buffers) result.push_back(buffer ? &*buffer : nullptr);
        return result;
    }

    cuda::Queue queue_;
    Owned prepared_, in_, out_;
    cuda::RecordedStage stage_;
};

struct Opened {
    std::string why_none;
    std::unique_ptr<cuda::Gpu> gpu;
    Opened() {
        for (const cuda::GpuInfo& info : cuda::list_gpus(why_none))
            if (gpu == nullptr && info.lacks.empty()) gpu = std::make_unique<cuda::Gpu>(info.ordinal);
    }
};
Opened& opened() {
    static Opened result;
    return result;
}

}  // namespace

bool available() {
    if (opened().gpu == nullptr) MESSAGE("skipped: no CUDA device: ", opened().why_none);
    return opened().gpu != nullptr;
}

cuda::Gpu& device() {
    if (opened().gpu == nullptr) throw StageError(DEFREC_ERROR_UNSUPPORTED, "no CUDA device");
    return *opened().gpu;
}

std::unique_ptr<Stage> in_host_memory(std::unique_ptr<cuda::Stage> stage) { return std::make_unique<InHostMemory>(std::move(stage)); }

}  // namespace defrec::under_test
