"""C#: what a job gives. FrameSummary has the numbers of a result, FrameResult its arrays as well;
Job copies single arrays."""
import math
import textwrap

from contract import PIXELS
from header import HeaderError
from names import camel, enumeration_of_field, pascal, sentence
from writers.csharp import SCALARS, TOP, VECTORS, is_public, struct_name, summary, words

STEP = " " * 4

SUMMARY = """\
/// <summary>State, reasons and numbers of one frame. Without a template counts are 0.</summary>
public struct FrameSummary
{{
{properties}

    internal unsafe FrameSummary(ref defrec_result result)
    {{
{copies}
    }}
}}
"""

RECORD = """\

{summary}
public struct {name}
{{
{properties}

    private {name}({parameters})
    {{
{kept}
    }}

    // Texts that have not changed are not made anew.
    internal static unsafe void Copy({struct}* from, {name}[] to)
    {{
        for (int i = 0; i < to.Length; ++i)
            to[i] = new {name}({members});
    }}
}}
"""

RESULT = """\

/// <summary>
/// A whole result, copied: it stays when the job is disposed. Give one object to
/// <see cref="Job.GetResult(FrameResult)"/> again and again, then arrays are made anew only when a
/// template with other counts comes. One thread at a time.
/// </summary>
public sealed unsafe class FrameResult
{{
    /// <summary>State, reasons and numbers.</summary>
    public FrameSummary Summary {{ get; private set; }}
{properties}

    internal void Fill(ref defrec_result result, int pixels)
    {{
        var summary = new FrameSummary(ref result);
        // All arrays before anything is changed: an allocation may fail.
{made}

{copies}

        Summary = summary;
{kept}
    }}
}}
"""

RETURNS = "Returns how many elements were copied; destination may be longer."
FAILURES = """\
/// <exception cref="ObjectDisposedException">The job was disposed.</exception>
/// <exception cref="DefrecException">The job is not done, or failed.</exception>"""

COPY_TO_ARRAY = """\
{summary}
/// <exception cref="ArgumentException">
/// destination is null or too short; the error message says what is needed.
/// </exception>
{failures}
public int {name}({element}[] destination)
{{
    Check.NotNull(destination, nameof(destination));
    fixed ({element}* to = destination) return {name}(to, destination.Length);
}}
"""

COPY_TO_SPAN = """\
/// <summary>Like <see cref="{name}({element}[])"/>.</summary>
/// <exception cref="ArgumentException">
/// destination is too short; the error message says what is needed.
/// </exception>
{failures}
public int {name}(Span<{element}> destination)
{{
    fixed ({element}* to = &MemoryMarshal.GetReference(destination))
        return {name}(to, destination.Length);
}}
"""

COPY = """\
private int {name}({element}* to, int capacity)
{{
    using (var use = new HandleUse(Handle))
    {{
        defrec_result result = Read(use);
        return Copy(result.{field}, {count}, sizeof({element}), to, capacity);
    }}
}}
"""

JOB = """\
{top}using System;
#if NETSTANDARD2_1
using System.Runtime.InteropServices;
#endif
using Defrec.Native;

namespace Defrec
{{
    // The arrays of a result, copied into memory of the caller. Nothing here allocates.
    public sealed unsafe partial class Job
    {{
{arrays}
#if NETSTANDARD2_1
{spans}
#endif

        // For arrays and spans alike; capacity in elements.
{pointers}
    }}
}}
"""


def comment(text):
    """Lines for what is indented by two steps later."""
    return [line.strip() for line in summary(text, 2 * STEP)]


def indented(lines, steps):
    return textwrap.indent("\n".join(lines), STEP * steps)


def element_type(contract, field):
    if kind := enumeration_of_field(field):
        return kind.csharp
    struct = contract.struct_of.get(field.element)
    if struct is None:
        return SCALARS[field.element]
    if not is_public(contract, struct) and not contract.holds_texts(field):
        raise HeaderError(f"{field.owner}.{field.name}: C# has no public struct {field.element}")
    return pascal(field.element.removeprefix("defrec_"))


def number_type(contract, field):
    """The type of a field that is no array; None where it is one, or a text."""
    if field.is_address or contract.holds_texts(field):
        return None
    if field.count:
        return VECTORS[field.type, field.count]
    kind = enumeration_of_field(field)
    return kind.csharp if kind else SCALARS.get(field.type) or struct_name(contract, field.type)


def text_of(field):
    """A comment without what the type says."""
    text = words(field.words())
    kind = enumeration_of_field(field)
    if kind and not field.is_address:
        text = text.removeprefix(f"{kind.csharp}: ")
    return text.replace("null", "empty") if field.leads_to_array else text


def getter(field, kind):
    return [*comment(text_of(field)), f"public {kind} {pascal(field.name)} {{ get; }}"]


def frame_summary(contract, fields):
    properties, copies = [], []
    for field in fields:
        name = pascal(field.name)
        if field.name in contract.result.counts:
            properties += getter(field, "int")
            copies.append(f"{name} = Check.ArrayLength(result.{field.name}, 1);")
        elif field.counted_by == PIXELS:
            properties += [
                f"/// <summary>Whether there is a {field.name}.</summary>",
                f"public bool Has{name} {{ get; }}",
            ]
            copies.append(f"Has{name} = result.{field.name} != null;")
        elif kind := number_type(contract, field):
            properties += getter(field, kind)
            copies.append(f"{name} = result.{field.name};")
    return SUMMARY.format(properties=indented(properties, 1), copies=indented(copies, 2))


def text_records(contract, field):
    """The public struct for records with texts."""
    struct = contract.struct_of[field.element]
    types = {each: "string" if each.is_text else SCALARS[each.type] for each in struct.fields}
    members = [
        (
            f"Utf8.Read(from[i].{each.name}, to[i].{pascal(each.name)})"
            if each.is_text
            else f"from[i].{each.name}"
        )
        for each in struct.fields
    ]
    return RECORD.format(
        summary="\n".join(comment(struct.summary.removesuffix(" Frozen."))),
        name=element_type(contract, field),
        struct=struct.name,
        properties=indented([line for each in types for line in getter(each, types[each])], 1),
        parameters=", ".join(f"{kind} {camel(each.name)}" for each, kind in types.items()),
        kept=indented([f"{pascal(each.name)} = {camel(each.name)};" for each in types], 2),
        members=", ".join(members),
    )


def frame_result(contract, fields):
    properties, made, copies, kept = [], [], [], []
    for field in fields:
        name, local, at = pascal(field.name), camel(field.name), f"result.{field.name}"
        if field.is_text:
            kind, empty = "string", '""'
            made.append(f"string {local} = Utf8.Read({at}, {name});")
        elif field.leads_to_array or contract.holds_texts(field):
            element = element_type(contract, field)
            kind, empty = f"{element}[]", f"new {element}[0]"
            count = f"result.{field.counted_by}"
            if contract.holds_texts(field):
                length = f"(int)Math.Min({count}, {field.type}s.Length)"
                copies += [
                    f"fixed ({field.type}* from = &{at}.first)",
                    f"{STEP}{element}.Copy(from, {local});",
                ]
            else:
                length = f"Check.ArrayLength({count}, {math.prod(field.shape)})"
                if field.counted_by == PIXELS:
                    length = f"{at} != null ? pixels : 0"
                copies += [
                    f"fixed ({element}* to = {local})",
                    f"{STEP}NativeArray.Copy({at}, to, {local}.Length, sizeof({element}));",
                ]
            made.append(f"{element}[] {local} = NativeArray.Sized({name}, {length});")
        else:
            continue
        properties += comment(text_of(field))
        properties.append(f"public {kind} {name} {{ get; private set; }} = {empty};")
        kept.append(f"{name} = {local};")
    return RESULT.format(
        properties=indented(properties, 1),
        made=indented(made, 2),
        copies=indented(copies, 2),
        kept=indented(kept, 2),
    )


def frame_results(contract):
    lengths = contract.result.own_counts
    fields = [
        field for field in contract.result.fields if not (field.is_hidden or field.name in lengths)
    ]
    with_texts = [field for field in fields if contract.holds_texts(field) and not field.is_address]
    types = [frame_summary(contract, fields)]
    types += [text_records(contract, field) for field in with_texts]
    types.append(frame_result(contract, fields))
    return (
        f"{TOP}using System;\nusing Defrec.Native;\n\nnamespace Defrec\n{{\n"
        + textwrap.indent("".join(types), STEP)
        + "}\n"
    )


def job_arrays(contract):
    arrays, spans, pointers = [], [], []
    for field in contract.result.fields:
        if not field.leads_to_array:
            continue
        many = math.prod(field.shape)
        count = f"result.{field.counted_by}"
        if field.counted_by == PIXELS:
            count = f"result.{field.name} == null ? 0 : (ulong)pixels"
        names = {
            "name": f"Copy{pascal(field.name)}",
            "element": element_type(contract, field),
            "field": field.name,
            "count": count if many == 1 else f"{many} * {count}",
            "summary": "\n".join(comment(f"{sentence(text_of(field))} {RETURNS}")),
            "failures": FAILURES,
        }
        arrays.append(COPY_TO_ARRAY.format(**names))
        spans.append(COPY_TO_SPAN.format(**names))
        pointers.append(COPY.format(**names))
    return JOB.format(
        top=TOP,
        arrays=indented(arrays, 2),
        spans=indented(spans, 2).rstrip(),
        pointers=indented(pointers, 2).rstrip(),
    )


def files(contract, root):
    assembly = "bindings/csharp/Defrec"
    return {
        f"{assembly}/FrameResult.cs": frame_results(contract),
        f"{assembly}/JobArrays.cs": job_arrays(contract),
    }
