#include "plugins/base/host_plugin.hpp"

#include <doctest/doctest.h>

#include <array>
#include <cstring>
#include <new>
#include <stdexcept>
#include <string>

#include "sdk/base/os/aligned_memory.hpp"

using namespace defrec;

namespace {

// What went through the host of a test.
struct Recorder {
    std::string error;
    int live = 0;
    bool out_of_memory = false;
};

defrec_host make_host(Recorder& recorder) {
    defrec_host host{};
    host.struct_size = sizeof host;
    host.self = &recorder;
    host.log = [](void*, int32_t, const char*) {};
    host.error = [](void* self, const char* text) { static_cast<Recorder*>(self)->error = text; };
    host.alloc = [](void* self, size_t size, size_t alignment) -> void* {
        auto& to = *static_cast<Recorder*>(self);
        if (to.out_of_memory) return nullptr;
        ++to.live;
        return allocate_aligned(size, alignment);
    };
    host.free = [](void* self, void* memory) {
        if (memory != nullptr) --static_cast<Recorder*>(self)->live;
        free_aligned(memory);
    };
    host.parallel_for = [](void*, size_t count, void (*body)(void*, size_t), void* arg) {
        for (size_t i = 0; i < count; ++i) body(arg, i);
    };
    host.concurrency = [](void*) { return 1u; };
    return host;
}

// Throws what its parameters' seed says; else output = input + 1.
class ThrowingStage : public Stage {
  public:
    explicit ThrowingStage(uint64_t what) : what_(what) { throw_at(1); }
    void prepare(std::span<const InBuffer>) override { throw_at(2); }
    void run(std::span<const InBuffer> in, std::span<const OutBuffer> out) override {
        throw_at(3);
        throw_at(4);
        throw_at(5);
        throw_at(6);
        const auto* from = take<uint8_t>("in", in[0], 4);
        auto* to = take<uint8_t>("out", out[0], 4);
        for (int i = 0; i < 4; ++i) to[i] = static_cast<uint8_t>(from[i] + 1);
    }

  private:
    void throw_at(uint64_t place) const {
        if (what_ != place) return;
        if (place == 4) throw std::bad_alloc();
        if (place == 5) throw std::runtime_error("unexpected");
        if (place == 6) throw 42;
        throw StageError(DEFREC_ERROR_UNSUPPORTED, "place " + std::to_string(place));
    }
    uint64_t what_;
};

std::unique_ptr<Stage> make_throwing(const defrec_ransac_params& params, const Host&) {
    return std::make_unique<ThrowingStage>(params.seed);
}

template <class Params>
std::unique_ptr<Stage> make_nothing(const Params&, const Host&) {
    return nullptr;
}

const HostPluginDescription kDescription{"test", "1.0", "Test", makers_of<make_throwing>()};

class Plugin {
  public:
    Plugin() : host_(make_host(recorder)) {
        REQUIRE(enter_host_plugin(kDescription, &host_, &table) == DEFREC_OK);
        REQUIRE(table->device_open(table->self, 0, &device) == DEFREC_OK);
        REQUIRE(table->queue_create(device, &queue) == DEFREC_OK);
    }
    ~Plugin() {
        table->queue_destroy(queue);
        table->device_close(device);
        table->shutdown(table->self);
        CHECK(recorder.live == 0);
    }
    Plugin(const Plugin&) = delete;
    Plugin& operator=(const Plugin&) = delete;

    // Status of making, preparing and running the stage.
    defrec_status run(uint64_t what) {
        const defrec_stage_table* stage = table->stage(table->self, DEFREC_STAGE_RANSAC);
        defrec_ransac_params params{};
        params.struct_size = sizeof params;
        params.seed = what;
        defrec_pstage* object = nullptr;
        defrec_pbuffer *in = nullptr, *out = nullptr;
        REQUIRE(table->buffer_create(device, 4, &in) == DEFREC_OK);
        REQUIRE(table->buffer_create(device, 4, &out) == DEFREC_OK);
        defrec_status status = stage->create(device, &params, &object);
        if (status == DEFREC_OK) status = stage->prepare(object, queue, &in, 1);
        if (status == DEFREC_OK) status = stage->enqueue(object, queue, &in, 1, &out, 1);
        result = {};
        if (status == DEFREC_OK) REQUIRE(table->read(queue, out, 0, &result, 4) == DEFREC_OK);
        stage->destroy(object);
        table->buffer_destroy(in);
        table->buffer_destroy(out);
        return status;
    }

    Recorder recorder;
    const defrec_plugin* table = nullptr;
    defrec_pdevice* device = nullptr;
    defrec_pqueue* queue = nullptr;
    std::array<uint8_t, 4> result{};

  private:
    defrec_host host_;
};

}  // namespace

TEST_CASE("makers stand at the stage that their parameters belong to, whatever their order") {
    constexpr auto kMakers =
        makers_of<make_nothing<defrec_warp_params>, make_nothing<defrec_rectify_params>>();
    for (uint32_t stage = 0; stage < kMakers.size(); ++stage)
        CHECK((kMakers[stage] != nullptr) ==
              (stage == DEFREC_STAGE_WARP || stage == DEFREC_STAGE_RECTIFY));
    CHECK((kMakers[DEFREC_STAGE_WARP] ==
           makers_of<make_nothing<defrec_warp_params>>()[DEFREC_STAGE_WARP]));
}

TEST_CASE("the tables are complete, and name what is offered") {
    Plugin plugin;
    CHECK(std::string(plugin.table->name) == "test");
    CHECK(plugin.table->abi_minor == DEFREC_PLUGIN_ABI_MINOR);
    // The table has only those optional functions that the backend offers.
    CHECK(!plugin.table->host_alloc);
    CHECK(!plugin.table->host_free);
    CHECK(!plugin.table->write_in_place);
    CHECK(plugin.table->device_count(plugin.table->self) == 1);
    defrec_device_info info{};
    info.struct_size = sizeof info;
    REQUIRE(plugin.table->device_info(plugin.table->self, 0, &info) == DEFREC_OK);
    CHECK(std::string(info.id) == "test");
    CHECK(info.kind == DEFREC_DEVICE_CPU);
    CHECK(info.memory_bytes > 0);
    CHECK(info.stages == 1u << DEFREC_STAGE_RANSAC);
    CHECK(plugin.table->device_info(plugin.table->self, 1, &info) == DEFREC_ERROR_ARGUMENT);
    for (uint32_t stage = 0; stage < 10; ++stage)
        CHECK((plugin.table->stage(plugin.table->self, stage) != nullptr) ==
              (stage == DEFREC_STAGE_RANSAC));
}

TEST_CASE("row 25: whatever a stage throws becomes a status with its error message") {
    Plugin plugin;
    CHECK(plugin.run(0) == DEFREC_OK);
    CHECK(plugin.result == std::array<uint8_t, 4>{1, 1, 1, 1});
    for (const uint64_t place : {1, 2, 3}) {
        CHECK(plugin.run(place) == DEFREC_ERROR_UNSUPPORTED);
        CHECK(plugin.recorder.error == "place " + std::to_string(place));
    }
    CHECK(plugin.run(4) == DEFREC_ERROR_OUT_OF_MEMORY);
    CHECK(plugin.run(5) == DEFREC_ERROR_INTERNAL);
    CHECK(plugin.recorder.error == "unexpected");
    CHECK(plugin.run(6) == DEFREC_ERROR_INTERNAL);
    CHECK(plugin.run(0) == DEFREC_OK);
}

TEST_CASE("buffers are zero, and no range outside them is read or written") {
    Plugin plugin;
    defrec_pbuffer* buffer = nullptr;
    REQUIRE(plugin.table->buffer_create(plugin.device, 8, &buffer) == DEFREC_OK);
    uint8_t bytes[16];
    std::memset(bytes, 0xA5, sizeof bytes);
    REQUIRE(plugin.table->read(plugin.queue, buffer, 0, bytes, 8) == DEFREC_OK);
    for (int i = 0; i < 16; ++i) CHECK(bytes[i] == (i < 8 ? 0 : 0xA5));
    CHECK(plugin.table->write(plugin.queue, buffer, 4, bytes + 8, 4) == DEFREC_OK);
    CHECK(plugin.table->read(plugin.queue, buffer, 4, bytes, 4) == DEFREC_OK);
    CHECK(bytes[0] == 0xA5);
    CHECK(plugin.table->read(plugin.queue, buffer, 1, bytes, 8) == DEFREC_ERROR_ARGUMENT);
    CHECK(plugin.table->write(plugin.queue, buffer, 9, bytes, 0) == DEFREC_ERROR_ARGUMENT);
    CHECK(plugin.table->write(plugin.queue, buffer, UINT64_MAX, bytes, 2) == DEFREC_ERROR_ARGUMENT);
    plugin.table->buffer_destroy(buffer);
}

TEST_CASE("imported memory is worked in where it lies, and stays the caller's") {
    Plugin plugin;
    const defrec_plugin& table = *plugin.table;
    alignas(16) uint8_t memory[16] = {1, 2, 3, 4};
    defrec_pbuffer* buffer = nullptr;
    REQUIRE(table.buffer_import(plugin.device, DEFREC_MEMORY_HOST, memory, 8, &buffer) ==
            DEFREC_OK);
    uint8_t bytes[4] = {};
    REQUIRE(table.read(plugin.queue, buffer, 0, bytes, 4) == DEFREC_OK);
    CHECK(bytes[3] == 4);
    bytes[0] = 9;
    REQUIRE(table.write(plugin.queue, buffer, 4, bytes, 4) == DEFREC_OK);
    CHECK(memory[4] == 9);
    CHECK(table.write(plugin.queue, buffer, 6, bytes, 4) == DEFREC_ERROR_ARGUMENT);
    table.buffer_destroy(buffer);
    CHECK(memory[0] == 1);
}

TEST_CASE(
    "memory that cannot be imported: another kind, NULL, not aligned, empty, beyond the address "
    "space") {
    Plugin plugin;
    const defrec_plugin& table = *plugin.table;
    alignas(16) uint8_t memory[32];
    defrec_pbuffer* buffer = nullptr;
    CHECK(table.buffer_import(plugin.device, DEFREC_MEMORY_CUDA, memory, 16, &buffer) ==
          DEFREC_ERROR_UNSUPPORTED);
    CHECK(plugin.recorder.error.find("kind 2 was given") != std::string::npos);
    CHECK(table.buffer_import(plugin.device, DEFREC_MEMORY_HOST, nullptr, 16, &buffer) ==
          DEFREC_ERROR_ARGUMENT);
    CHECK(table.buffer_import(plugin.device, DEFREC_MEMORY_HOST, memory + 8, 16, &buffer) ==
          DEFREC_ERROR_ARGUMENT);
    CHECK(plugin.recorder.error.find("multiple of 16") != std::string::npos);
    CHECK(table.buffer_import(plugin.device, DEFREC_MEMORY_HOST, memory, 0, &buffer) ==
          DEFREC_ERROR_ARGUMENT);
    CHECK(table.buffer_import(plugin.device, DEFREC_MEMORY_HOST, memory, UINT64_MAX, &buffer) ==
          DEFREC_ERROR_ARGUMENT);
    CHECK(buffer == nullptr);
}

TEST_CASE("row 50: a host without memory is an error, not a crash") {
    Plugin plugin;
    plugin.recorder.out_of_memory = true;
    defrec_pbuffer* buffer = nullptr;
    CHECK(plugin.table->buffer_create(plugin.device, 8, &buffer) == DEFREC_ERROR_OUT_OF_MEMORY);
    CHECK(buffer == nullptr);
    plugin.recorder.out_of_memory = false;
}

TEST_CASE("a queue's points grow, and one that was not reached is not waited for") {
    Plugin plugin;
    uint64_t first = 0, second = 0;
    CHECK(plugin.table->signal(plugin.queue, &first) == DEFREC_OK);
    CHECK(plugin.table->signal(plugin.queue, &second) == DEFREC_OK);
    CHECK(second > first);
    CHECK(plugin.table->wait(plugin.queue, second, 0) == DEFREC_OK);
    CHECK(plugin.table->wait(plugin.queue, second + 1, 0) == DEFREC_TIMEOUT);
}

TEST_CASE("row 36: a host without what the backend needs is refused") {
    Recorder recorder;
    defrec_host host = make_host(recorder);
    const defrec_plugin* table = nullptr;
    CHECK(enter_host_plugin(kDescription, nullptr, &table) == DEFREC_ERROR_ARGUMENT);
    CHECK(enter_host_plugin(kDescription, &host, nullptr) == DEFREC_ERROR_ARGUMENT);
    host.struct_size = 24;
    CHECK(enter_host_plugin(kDescription, &host, &table) == DEFREC_ERROR_VERSION);
    host = make_host(recorder);
    host.alloc = nullptr;
    CHECK(enter_host_plugin(kDescription, &host, &table) == DEFREC_ERROR_VERSION);
    CHECK(table == nullptr);
}
