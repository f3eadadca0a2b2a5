// What plugins need not offer: host memory, writes in place, the application's memory as a buffer.
#include "sdk/device/device.hpp"

#include <doctest/doctest.h>

#include <cstring>

#include "sdk/base/os/aligned_memory.hpp"
#include "sdk/device/context.hpp"
#include "sdk/testing/test_files.hpp"

namespace {

using namespace defrec;

struct Memory {
    size_t live = 0;
    static void* take(void* user, size_t size, size_t alignment) {
        ++static_cast<Memory*>(user)->live;
        void* memory = allocate_aligned(size, alignment);
        std::memset(memory, 0x5b, size);
        return memory;
    }
    static void give(void* user, void* memory) {
        --static_cast<Memory*>(user)->live;
        free_aligned(memory);
    }
};

std::shared_ptr<Device> open_stub(const char* name, Memory& memory) {
    const std::string folder = test::stub_folder(name).string();
    const char* places[] = {folder.c_str()};
    defrec_context_desc desc{};
    desc.flags = DEFREC_CONTEXT_ONLY_GIVEN_PLUGINS;
    desc.plugin_paths = places;
    desc.plugin_path_count = 1;
    desc.threads = 1;
    desc.alloc = Memory::take;
    desc.free = Memory::give;
    desc.alloc_user = &memory;
    return Context::create(desc)
        ->choose_device("stub", 1u << DEFREC_STAGE_RANSAC)
        .devices.front()
        .open();
}

// What a buffer holds when its source changed between the write and the read.
uint8_t changed_on_the_way(const std::shared_ptr<Device>& device) {
    HostMemory source(device, 100), back(device, 100);
    Queue queue(device);
    const DeviceBuffer buffer(device, 100);
    source.as<uint8_t>()[99] = 1;
    queue.write_in_place(buffer, source.as<uint8_t>().data(), 100);
    source.as<uint8_t>()[99] = 2;
    queue.read(buffer, back.as<uint8_t>().data(), 100);
    queue.finish();
    return back.as<uint8_t>()[99];
}

defrec_status status_of_import(const std::shared_ptr<Device>& device, uint32_t kind, void* memory) {
    try {
        const DeviceBuffer buffer = DeviceBuffer::import(device, kind, memory, 64);
        return buffer.size() == 64 && buffer ? DEFREC_OK : DEFREC_ERROR_INTERNAL;
    } catch (const Error& error) {
        return error.status();
    }
}

}  // namespace

TEST_CASE(
    "host memory is the plugin's where it has some, else the context's: aligned, zero, and its "
    "device stays open") {
    for (const auto& [name, own] : {std::pair{"host_memory", true}, {"good", false}}) {
        CAPTURE(name);
        Memory memory;
        std::shared_ptr<Device> device = open_stub(name, memory);
        const size_t before = memory.live;
        HostMemory first(device, 1000);
        device.reset();
        CHECK(memory.live == before + (own ? 0 : 1));
        CHECK(reinterpret_cast<uintptr_t>(first.as<uint8_t>().data()) % 64 == 0);
        CHECK(first.size() == 1000);
        CHECK(first.as<double>().size() == 125);
        for (const uint8_t byte : first.as<uint8_t>()) REQUIRE(byte == 0);
        first.as<double>()[124] = 3;
        HostMemory second = std::move(first);
        CHECK(first.as<uint8_t>().empty());
        CHECK(std::as_const(second).as<double>()[124] == 3);
        second = HostMemory();
        CHECK(memory.live == 0);  // and with the last of it the plugin's instance went
    }
}

TEST_CASE("empty host memory takes none") {
    Memory memory;
    const std::shared_ptr<Device> device = open_stub("good", memory);
    const size_t before = memory.live;
    HostMemory none(device, 0);
    CHECK(none.as<uint8_t>().empty());
    CHECK(memory.live == before);
}

TEST_CASE(
    "a write in place reads its source when the queue gets there; without it the source is copied "
    "at once") {
    Memory memory;
    CHECK(changed_on_the_way(open_stub("host_memory", memory)) == 2);
    CHECK(changed_on_the_way(open_stub("good", memory)) == 1);
}

TEST_CASE(
    "imported memory is the buffer's own; kinds out of reach and plugins without import are "
    "refused") {
    Memory memory;
    const std::shared_ptr<Device> device = open_stub("host_memory", memory);
    uint8_t bytes[64] = {}, back[64] = {};
    {
        Queue queue(device);
        const DeviceBuffer buffer =
            DeviceBuffer::import(device, DEFREC_MEMORY_HOST, bytes, sizeof bytes);
        const uint8_t value = 7;
        queue.write(buffer, &value, 1, 63);
        CHECK(bytes[63] == 7);
        bytes[0] = 5;
        queue.read(buffer, back, sizeof back);
        CHECK(back[0] == 5);
        CHECK_THROWS_AS(queue.write_in_place(buffer, back, 65), Error);
    }
    CHECK(bytes[63] == 7);
    CHECK(status_of_import(device, DEFREC_MEMORY_HOST, bytes) == DEFREC_OK);
    CHECK(status_of_import(device, DEFREC_MEMORY_CUDA, bytes) == DEFREC_ERROR_UNSUPPORTED);
    CHECK(status_of_import(open_stub("good", memory), DEFREC_MEMORY_HOST, bytes) ==
          DEFREC_ERROR_UNSUPPORTED);
}
