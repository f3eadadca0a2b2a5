// The plugin `cuda`: backends/cuda behind the plugin ABI, one device for each GPU that the CUDA
// driver shows.
#include "plugins/base/plugin.hpp"

#include "backends/cuda/gpu/gpu.hpp"
#include "backends/cuda/gpu/recorded_stage.hpp"
#include "backends/cuda/stages.hpp"

namespace defrec::cuda {
constexpr auto kMakers = makers_of<DEFREC_STAGES(DEFREC_STAGE_MAKER, DEFREC_COMMA)>();
}  // namespace defrec::cuda

namespace defrec {
namespace {

class CudaBackend {
  public:
    using Device = cuda::Gpu;
    using Buffer = cuda::Buffer;
    using Queue = cuda::Queue;
    using Stage = cuda::RecordedStage;

    explicit CudaBackend(const defrec_host* host) {
        std::string why_none;
        gpus_ = cuda::list_gpus(why_none);
        if (gpus_.empty())
            host->log(host->self, DEFREC_LOG_INFO, ("no CUDA device: " + why_none).c_str());
    }

    const char* name() const { return "cuda"; }
    const char* version() const { return DEFREC_RELEASE; }
    size_t device_count() const { return gpus_.size(); }
    bool offers(uint32_t) const { return true; }

    void describe(size_t index, defrec_device_info& info) const {
        const cuda::GpuInfo& gpu = gpus_[index];
        if (!gpu.broken.empty()) throw StageError(DEFREC_ERROR_DEVICE_LOST, gpu.broken);
        info.kind = DEFREC_DEVICE_CUDA;
        info.id = gpu.id.c_str();
        info.name = gpu.name.c_str();
        info.driver = gpu.driver.c_str();
        info.memory_bytes = gpu.memory_bytes;
        // A device that lacks what the stages need is listed with none, so that nobody wonders
        // where it is.
        if (!gpu.lacks.empty()) info.stages = 0;
        info.features = DEFREC_FEATURE_REPEATABLE;
    }
    std::unique_ptr<Device> open(size_t index) const {
        const cuda::GpuInfo& gpu = gpus_[index];
        if (!gpu.lacks.empty())
            throw StageError(DEFREC_ERROR_UNSUPPORTED, gpu.name + ": " + gpu.lacks);
        return std::make_unique<Device>(gpu.ordinal);
    }

    Buffer make_buffer(Device& gpu, uint64_t size) const {
        Buffer buffer(gpu, size);
        gpu.clear(buffer.data(), size);
        return buffer;
    }
    Buffer import_buffer(Device& gpu, uint32_t kind, void* memory, uint64_t size) const {
        if (kind != DEFREC_MEMORY_CUDA)
            throw StageError(DEFREC_ERROR_UNSUPPORTED,
                             "cuda computes in memory of a CUDA device, kind " +
                                 std::to_string(DEFREC_MEMORY_CUDA) + "; kind " +
                                 std::to_string(kind) + " was given");
        gpu.expect_device_memory(memory, size);
        return Buffer::borrowed(memory, size);
    }
    void* allocate_host(Device& gpu, uint64_t size) const { return gpu.allocate_host(size); }
    void release_host(Device& gpu, void* memory) const noexcept { gpu.release_host(memory); }

    Stage make_stage(Device& gpu, uint32_t stage, const void* params) const {
        return Stage(gpu, cuda::kMakers[stage](params, gpu));
    }
    // Makers refuse what the device cannot do; what that takes is made and thrown away.
    void check_support(Device& gpu, uint32_t stage, const void* params) const {
        cuda::kMakers[stage](params, gpu);
    }

  private:
    std::vector<cuda::GpuInfo> gpus_;
};

}  // namespace
}  // namespace defrec

extern "C" DEFREC_PLUGIN_EXPORT defrec_status DEFREC_CALL
defrec_plugin_entry_v1(const defrec_host* host, const defrec_plugin** out) {
    return defrec::enter_plugin<defrec::CudaBackend>(host, out, host);
}
