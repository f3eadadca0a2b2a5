// Devices: what they say of themselves, opened and closed.
#include <cstring>
#include <set>

#include "conformance/cases/abi/abi.hpp"
#include "sdk/contract/enumerations.hpp"

namespace defrec::conformance {
namespace {

constexpr unsigned char kGuard = 0xA5;

// The device's info in a struct of that size, followed by guard bytes; both as bytes.
Bytes info_of_size(const Instance& instance, size_t index, uint32_t size) {
    Bytes bytes(size + 64, std::byte{kGuard});
    std::memset(bytes.data(), 0, size);
    std::memcpy(bytes.data(), &size, sizeof size);
    instance.check("device_info", instance.table().device_info(
                                      instance.table().self, index,
                                      reinterpret_cast<defrec_device_info*>(bytes.data())));
    return bytes;
}

void info_sizes(CaseRun& run) {
    const Instance instance(run.subject_plugin());
    constexpr uint32_t kWhole = sizeof(defrec_device_info);
    for (size_t i = 0; i < instance.devices().size(); ++i) {
        const Bytes whole = info_of_size(instance, i, kWhole);
        for (const uint32_t size :
             {uint32_t(sizeof(uint32_t)), uint32_t(offsetof(defrec_device_info, id)),
              uint32_t(offsetof(defrec_device_info, memory_bytes)), kWhole, kWhole + 32}) {
            const Bytes given = info_of_size(instance, i, size);
            uint32_t said = 0;
            std::memcpy(&said, given.data(), sizeof said);
            require(said == size, "device_info changed struct_size from ", size, " to ", said);
            for (uint32_t byte = sizeof said; byte < std::min(size, kWhole); ++byte)
                require(given[byte] == whole[byte], "device_info into a struct of ", size,
                        " bytes: byte ", byte, " is another than in a whole one");
            for (uint32_t byte = kWhole; byte < size; ++byte)
                require(given[byte] == std::byte{0}, "device_info wrote byte ", byte,
                        " of a later version's struct, which it cannot know");
            for (uint32_t byte = size; byte < given.size(); ++byte)
                require(given[byte] == std::byte{kGuard}, "device_info wrote byte ", byte,
                        " of a struct of ", size, " bytes");
        }
    }
}

void info_out_of_range(CaseRun& run) {
    const Instance instance(run.subject_plugin());
    const size_t count = instance.devices().size();
    for (const size_t index : {count, count + 1, SIZE_MAX}) {
        defrec_device_info info, before;
        std::memset(&info, kGuard, sizeof info);
        info.struct_size = sizeof info;
        before = info;
        require_refused(instance, "device_info of a device that does not exist",
                        instance.table().device_info(instance.table().self, index, &info));
        require(std::memcmp(&info, &before, sizeof info) == 0,
                "device_info refused, but wrote its output");
        defrec_pdevice* device = nullptr;
        require_refused(instance, "device_open of a device that does not exist",
                        instance.table().device_open(instance.table().self, index, &device));
        require(device == nullptr, "device_open refused, but wrote its output");
    }
}

std::vector<std::string> ids(const Instance& instance) {
    std::vector<std::string> result;
    for (const defrec_device_info& info : instance.devices())
        result.emplace_back(info.id == nullptr ? "" : info.id);
    return result;
}

void ids_stable(CaseRun& run) {
    const Instance first(run.subject_plugin()), second(run.subject_plugin());
    const std::vector<std::string> known = ids(first);
    for (const std::string& id : known)
        require(!id.empty() && id.size() <= 255, "a device has an id of ", id.size(),
                " bytes, 1 to 255 expected");
    require(std::set(known.begin(), known.end()).size() == known.size(),
            "two devices have the same id");
    require(ids(first) == known, "device_info gave other ids when it was called again");
    require(ids(second) == known, "another instance gave its devices other ids");
    for (const std::string& id : known) run.digest(std::as_bytes(std::span(id)));
}

void info_makes_sense(CaseRun& run) {
    const Instance instance(run.subject_plugin());
    for (const defrec_device_info& info : instance.devices()) {
        const std::string id = info.id == nullptr ? "" : info.id;
        require(info.kind != 0, id, ": kind is 0");
        require(info.name != nullptr && info.name[0] != '\0', id, ": there is no name");
        require(info.driver != nullptr, id, ": driver is NULL");
        require(info.memory_bytes > 0, id, ": memory_bytes is 0");
        require((info.stages & kEveryStage) != 0, id, ": offers no stage");
        require(
            (info.features & ~uint32_t{DEFREC_FEATURE_REPEATABLE | DEFREC_FEATURE_SOFTWARE}) == 0,
            id, ": claims features that this version does not have");
        require(info.reserved == 0, id, ": reserved is not 0");
    }
}

void open_twice(CaseRun& run) {
    const Instance instance(run.subject_plugin());
    const defrec_plugin& table = instance.table();
    for (size_t i = 0; i < instance.devices().size(); ++i) {
        defrec_pdevice *first = nullptr, *second = nullptr;
        instance.check("device_open", table.device_open(table.self, i, &first));
        instance.check("device_open of an open device", table.device_open(table.self, i, &second));
        require(first != nullptr && second != nullptr && first != second,
                "device_open of an open device gave no device of its own");
        defrec_pbuffer* buffer = nullptr;
        table.device_close(first);
        instance.check("buffer_create after another device was closed",
                       table.buffer_create(second, 64, &buffer));
        table.buffer_destroy(buffer);
        table.device_close(second);
        instance.check("device_open after device_close", table.device_open(table.self, i, &first));
        table.device_close(first);
    }
}

void unknown_stages(CaseRun& run) {
    const Instance instance(run.subject_plugin());
    for (const uint32_t stage :
         {uint32_t{DEFREC_STAGE_COUNT_V1}, 31u, 32u, 1000u, 0x80000000u, UINT32_MAX})
        require(instance.table().stage(instance.table().self, stage) == nullptr,
                "there is a table for stage ", stage, ", which does not exist");
}

}  // namespace

void add_abi_device_cases(std::vector<Case>& cases) {
    add_abi_case(cases, "device_info_sizes", "device_info writes as many bytes as both sides know.",
                 info_sizes);
    add_abi_case(cases, "device_out_of_range",
                 "A device that does not exist is refused, and no output touched.",
                 info_out_of_range);
    add_abi_case(cases, "device_ids", "Ids of devices are unique, and the same each time.",
                 ids_stable);
    add_abi_case(cases, "device_info", "Devices say what they are, and offer a stage.",
                 info_makes_sense);
    add_abi_case(cases, "device_open_twice",
                 "A device can be open twice, and closed and opened again.", open_twice);
    add_abi_case(cases, "unknown_stages", "There is no table for a stage that does not exist.",
                 unknown_stages);
}

}  // namespace defrec::conformance
