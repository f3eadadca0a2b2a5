// See gpu.hpp.
#include "backends/cuda/gpu/gpu.hpp"

#include <cuda.h>
#include <dlfcn.h>

#include <algorithm>
#include <cstdio>
#include <cstring>
#include <filesystem>

#include "backends/cuda/gpu/check.hpp"
#include "backends/cuda/gpu/queue.hpp"

namespace defrec::cuda {
namespace {

constexpr int kMinCapability = 75;

// The driver's functions that the runtime has no counterpart for.
struct DriverFunctions {
    decltype(&cuCtxPushCurrent) push = nullptr;
    decltype(&cuCtxPopCurrent) pop = nullptr;
    decltype(&cuCtxGetCurrent) current = nullptr;
    decltype(&cuCtxSetCurrent) make_current = nullptr;

    DriverFunctions() {
        find("cuCtxPushCurrent", push);
        find("cuCtxPopCurrent", pop);
        find("cuCtxGetCurrent", current);
        find("cuCtxSetCurrent", make_current);
    }

  private:
    template <class Function>
    static void find(const char* name, Function& function) {
        void* found = nullptr;
        cudaDriverEntryPointQueryResult result;
        check(cudaGetDriverEntryPointByVersion(name, &found, 12000, cudaEnableDefault, &result),
              name);
        if (result != cudaDriverEntryPointSuccess)
            throw StageError(DEFREC_ERROR_UNSUPPORTED,
                             std::string("the CUDA driver lacks ") + name);
        function = reinterpret_cast<Function>(found);
    }
};
const DriverFunctions& driver() {
    static const DriverFunctions functions;
    return functions;
}

std::string uuid_text(const cudaUUID_t& uuid) {
    std::string text = "GPU-";
    for (size_t i = 0; i < sizeof uuid.bytes; ++i) {
        char two[3];
        std::snprintf(two, sizeof two, "%02x", static_cast<unsigned char>(uuid.bytes[i]));
        text += two;
        if (i == 3 || i == 5 || i == 7 || i == 9) text += '-';
    }
    return text;
}

uint32_t attribute(cudaDeviceAttr which, int ordinal) {
    int value = 0;
    check(cudaDeviceGetAttribute(&value, which, ordinal), "cudaDeviceGetAttribute");
    return static_cast<uint32_t>(value);
}

Limits read_limits(int ordinal) {
    return {attribute(cudaDevAttrMultiProcessorCount, ordinal),
            attribute(cudaDevAttrMaxSharedMemoryPerBlockOptin, ordinal),
            attribute(cudaDevAttrMaxSharedMemoryPerMultiprocessor, ordinal),
            10 * attribute(cudaDevAttrComputeCapabilityMajor, ordinal) +
                attribute(cudaDevAttrComputeCapabilityMinor, ordinal)};
}

std::string version_text(int version) {
    return std::to_string(version / 1000) + "." + std::to_string(version % 1000 / 10);
}

// CUDA tells which of its versions the driver is good for, not the driver's own; that is in the
// name of its library, libcuda.so.580.65.06.
std::string driver_text(int cuda_version) {
    const std::string cuda = "CUDA " + version_text(cuda_version);
    Dl_info library;
    if (dladdr(reinterpret_cast<void*>(driver().push), &library) == 0 ||
        library.dli_fname == nullptr)
        return cuda;
    std::error_code error;
    const std::string file =
        std::filesystem::canonical(library.dli_fname, error).filename().string();
    const size_t version = file.find(".so.");
    return error || version == std::string::npos ? cuda : file.substr(version + 4) + ", " + cuda;
}

// Fills all but the ordinal and the driver. Throws StageError where CUDA cannot.
void describe(GpuInfo& info) {
    cudaDeviceProp properties;
    check(cudaGetDeviceProperties(&properties, info.ordinal), "cudaGetDeviceProperties");
    info.id = "cuda:" + uuid_text(properties.uuid);
    info.name = properties.name;
    info.memory_bytes = properties.totalGlobalMem;
    if (10 * properties.major + properties.minor < kMinCapability)
        info.lacks = "compute capability " + std::to_string(properties.major) + "." +
                     std::to_string(properties.minor) + "; 7.5 is needed";
    else if (!attribute(cudaDevAttrCooperativeLaunch, info.ordinal))
        info.lacks = "it cannot launch cooperative grids";
}

}  // namespace

std::vector<GpuInfo> list_gpus(std::string& why_none) {
    int count = 0, driver_version = 0;
    const cudaError_t error = cudaGetDeviceCount(&count);
    if (error != cudaSuccess) {
        cudaGetLastError();
        cudaDriverGetVersion(&driver_version);
        why_none = driver_version == 0
                       ? "there is no CUDA driver"
                       : "CUDA driver " + version_text(driver_version) + ", made for " +
                             version_text(CUDART_VERSION) + ": " + cudaGetErrorString(error);
        return {};
    }
    check(cudaDriverGetVersion(&driver_version), "cudaDriverGetVersion");
    const std::string driver = count == 0 ? "" : driver_text(driver_version);
    std::vector<GpuInfo> gpus;
    for (int ordinal = 0; ordinal < count; ++ordinal) {
        GpuInfo info{};
        info.ordinal = ordinal;
        info.driver = driver;
        try {
            describe(info);
        } catch (const StageError& broken) {
            info.broken = "GPU " + std::to_string(ordinal) + ": " + broken.what();
        }
        gpus.push_back(std::move(info));
    }
    if (gpus.empty()) why_none = "there is no CUDA device";
    return gpus;
}

Gpu::Gpu(int ordinal) : ordinal_(ordinal), limits_(read_limits(ordinal)) {
    CUcontext before = nullptr, primary = nullptr;
    driver().current(&before);
    const cudaError_t error = cudaSetDevice(ordinal);
    driver().current(&primary);
    context_ = primary;
    driver().make_current(before);
    check(error, "opening the CUDA device");
    const Use use(*this);
    check(cudaStreamCreateWithFlags(&stream_, cudaStreamNonBlocking), "cudaStreamCreate");
}

Gpu::~Gpu() {
    const Use use(*this);
    cudaStreamDestroy(stream_);
}

// An application's capture in CUDA's default mode forbids the process's other threads many calls,
// and one of them would spoil the capture.
Gpu::Use::Use(const Gpu& gpu) {
    driver().push(static_cast<CUcontext>(gpu.context_));
    cudaThreadExchangeStreamCaptureMode(&mode_);
}
Gpu::Use::~Use() {
    cudaThreadExchangeStreamCaptureMode(&mode_);
    CUcontext popped;
    driver().pop(&popped);
}

std::byte* Gpu::allocate(uint64_t size) {
    const Use use(*this);
    void* memory = nullptr;
    const cudaError_t error = cudaMalloc(&memory, std::max<uint64_t>(size, 1));
    if (error == cudaErrorMemoryAllocation) {
        cudaGetLastError();
        size_t free = 0, all = 0;
        cudaMemGetInfo(&free, &all);
        throw StageError(DEFREC_ERROR_OUT_OF_MEMORY,
                         "out of device memory: " + std::to_string(size) + " bytes asked for, " +
                             std::to_string(free) + " of " + std::to_string(all) + " free");
    }
    check(error, "cudaMalloc");
    return static_cast<std::byte*>(memory);
}
void Gpu::release(std::byte* memory) noexcept {
    const Use use(*this);
    cudaFree(memory);
}
void Gpu::copy_to_device(std::byte* to, const void* from, uint64_t size) {
    if (size == 0) return;
    const Use use(*this);
    check(cudaMemcpyAsync(to, from, size, cudaMemcpyHostToDevice, stream_), "cudaMemcpyAsync");
    check(cudaStreamSynchronize(stream_), "cudaStreamSynchronize");
}
void Gpu::clear(std::byte* memory, uint64_t size) {
    if (size == 0) return;
    const Use use(*this);
    check(cudaMemsetAsync(memory, 0, size, stream_), "cudaMemsetAsync");
    check(cudaStreamSynchronize(stream_), "cudaStreamSynchronize");
}
uint32_t Gpu::resident_blocks(const void* function, uint32_t threads, size_t shared) const {
    const Use use(*this);
    allow_shared(function, shared, limits_);
    int per_multiprocessor = 0;
    check(cudaOccupancyMaxActiveBlocksPerMultiprocessor(&per_multiprocessor, function,
                                                        static_cast<int>(threads), shared),
          "cudaOccupancyMaxActiveBlocksPerMultiprocessor");
    return static_cast<uint32_t>(per_multiprocessor) * limits_.multiprocessors;
}

bool Gpu::holds_cluster(const void* function, uint32_t blocks, uint32_t threads,
                        size_t shared) const {
    constexpr int kCapability = 90;
    const Use use(*this);
    cudaFuncAttributes attributes;
    check(cudaFuncGetAttributes(&attributes, function), "cudaFuncGetAttributes");
    // Code for earlier devices that the driver has translated for this one has no clusters either.
    if (limits_.compute_capability < kCapability || attributes.ptxVersion < kCapability ||
        shared + attributes.sharedSizeBytes > limits_.shared_per_block)
        return false;
    allow_shared(function, shared, limits_);
    allow_cluster(function);
    cudaLaunchAttribute size{};
    size.id = cudaLaunchAttributeClusterDimension;
    size.val.clusterDim = {blocks, 1, 1};
    cudaLaunchConfig_t config{};
    config.gridDim = dim3(blocks);
    config.blockDim = dim3(threads);
    config.dynamicSmemBytes = shared;
    config.attrs = &size;
    config.numAttrs = 1;
    int clusters = 0;
    const cudaError_t answer = cudaOccupancyMaxActiveClusters(&clusters, function, &config);
    if (answer == cudaErrorInvalidClusterSize || answer == cudaErrorInvalidConfiguration) {
        cudaGetLastError();  // clears it
        return false;
    }
    check(answer, "cudaOccupancyMaxActiveClusters");
    return clusters > 0;
}

void* Gpu::allocate_host(uint64_t size) {
    const Use use(*this);
    void* memory = nullptr;
    const uint64_t bytes = std::max<uint64_t>(size, 1);
    check(cudaHostAlloc(&memory, bytes, cudaHostAllocPortable), "cudaHostAlloc");
    std::memset(memory, 0, bytes);
    try {
        const std::lock_guard lock(host_mutex_);
        host_memory_.emplace(static_cast<std::byte*>(memory), HostMemory{bytes, next_serial()});
    } catch (...) {
        cudaFreeHost(memory);
        throw;
    }
    return memory;
}
void Gpu::release_host(void* memory) noexcept {
    if (memory == nullptr) return;
    {
        const std::lock_guard lock(host_mutex_);
        host_memory_.erase(static_cast<std::byte*>(memory));
    }
    const Use use(*this);
    cudaFreeHost(memory);
}
uint64_t Gpu::host_serial(const void* memory, uint64_t size) const {
    const auto* first = static_cast<const std::byte*>(memory);
    const std::shared_lock lock(host_mutex_);
    auto after = host_memory_.upper_bound(first);
    if (after == host_memory_.begin()) return 0;
    const auto& [start, known] = *std::prev(after);
    const auto offset = static_cast<uint64_t>(first - start);
    return offset <= known.size && size <= known.size - offset ? known.serial : 0;
}

void Gpu::expect_device_memory(const void* memory, uint64_t size) const {
    const Use use(*this);
    const auto* first = static_cast<const std::byte*>(memory);
    for (const std::byte* at : {first, first + (size == 0 ? 0 : size - 1)}) {
        cudaPointerAttributes attributes{};
        const cudaError_t error = cudaPointerGetAttributes(&attributes, at);
        if (error != cudaSuccess) cudaGetLastError();
        if (error != cudaSuccess ||
            (attributes.type != cudaMemoryTypeDevice && attributes.type != cudaMemoryTypeManaged))
            throw StageError(DEFREC_ERROR_ARGUMENT, "the address is not CUDA device memory");
        if (attributes.device != ordinal_)
            throw StageError(DEFREC_ERROR_ARGUMENT,
                             "the memory is of CUDA device " + std::to_string(attributes.device) +
                                 ", this is device " + std::to_string(ordinal_));
    }
}

void Gpu::attach(Queue& queue) {
    const std::lock_guard lock(queue_mutex_);
    queues_.push_back(&queue);
}
void Gpu::detach(Queue& queue) noexcept {
    const std::lock_guard lock(queue_mutex_);
    std::erase(queues_, &queue);
}
void Gpu::settle() noexcept {
    const std::lock_guard lock(queue_mutex_);
    for (Queue* queue : queues_) queue->settle();
}

}  // namespace defrec::cuda
