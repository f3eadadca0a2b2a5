using System;
using System.Collections.Generic;
using Defrec.Native;

namespace Defrec
{
    /// <summary>A named part of a plan's model: a tumour, a vessel.</summary>
    public sealed class PlanPart
    {
        /// <summary>1 to 255 bytes of UTF-8.</summary>
        public string Name { get; }
        /// <summary>Index of its first triangle.</summary>
        public int FirstTriangle { get; }
        /// <summary>Its triangles follow one another.</summary>
        public int TriangleCount { get; }

        /// <summary>So many triangles from one on.</summary>
        public PlanPart(string name, int firstTriangle, int triangleCount)
        {
            Name = name;
            FirstTriangle = firstTriangle;
            TriangleCount = triangleCount;
        }
    }

    /// <summary>
    /// A preoperative model and targets, registered to a template once, kept in a file and followed
    /// in each frame by <see cref="Job.MovePlan"/>. It follows the template and what it becomes by
    /// growing or by a cut. Points are its vertices, then its targets. Any thread.
    /// </summary>
    public sealed unsafe class Plan : IDisposable
    {
        internal readonly PlanHandle Handle;

        private Plan(PlanHandle handle) { Handle = handle; }

        /// <summary>
        /// registration: its seen frame is the template frame; copied, as are the others. model,
        /// model frame, parts of its triangles, and targets, x, y, z of each, mm, may be null.
        /// targetNames: of each target, null or "" for one without, else no two alike; null: none
        /// has one. lookedAt: a person has looked at the registration, so that its verdict may be
        /// another than <see cref="Verdict.Accepted"/>, but for <see cref="Verdict.Failed"/>.
        /// </summary>
        /// <exception cref="ArgumentException">
        /// template, registration, an array or a part's name is null, or an array not a multiple of
        /// 3 long, or there are not as many names as targets.
        /// </exception>
        /// <exception cref="ObjectDisposedException">
        /// The template was disposed, or the registration was.
        /// </exception>
        /// <exception cref="DefrecException">
        /// The verdict is not allowed, something is not finite, out of its range or without a name,
        /// or two targets have the same one (<see cref="Status.ErrorArgument"/>).
        /// </exception>
        public static Plan Create(
            Template template, Registration registration, TriangleMesh model = null,
            IList<PlanPart> parts = null, double[] targets = null, bool lookedAt = false,
            IList<string> targetNames = null)
        {
            Check.NotNull(template, nameof(template));
            Check.NotNull(registration, nameof(registration));
            model = model ?? new TriangleMesh();
            parts = parts ?? new PlanPart[0];
            targets = targets ?? new double[0];
            Check.NotNull(model.Vertices, "model.Vertices");
            Check.NotNull(model.Triangles, "model.Triangles");
            int targetCount = Check.Groups(targets.Length, 3, nameof(targets));
            if (targetNames != null && targetNames.Count != targetCount)
                throw new ArgumentException(
                    "There are " + targetNames.Count + " names, " + targetCount + " expected.",
                    nameof(targetNames));
            var handle = new PlanHandle(template.Handle.Log);
            var names = new IntPtr[targetNames == null ? 0 : targetCount];
            var named = new defrec_plan_part[parts.Count];
            using (var pins = new Pins())
            {
                for (int i = 0; i < named.Length; ++i)
                {
                    string item = "parts[" + i + "]";
                    Check.NotNull(parts[i], item);
                    Check.NotNull(parts[i].Name, item + ".Name");
                    named[i].name = (byte*)pins.Add(Utf8.Bytes(parts[i].Name, item + ".Name"));
                    named[i].first_triangle = (ulong)parts[i].FirstTriangle;
                    named[i].triangle_count = (ulong)parts[i].TriangleCount;
                }
                for (int i = 0; i < names.Length; ++i)
                    names[i] = (IntPtr)pins.Add(
                        Utf8.Bytes(targetNames[i] ?? "", "targetNames[" + i + "]"));
                var desc = new defrec_plan_desc {
                    struct_size = (uint)sizeof(defrec_plan_desc),
                    flags = lookedAt ? PlanFlags.LookedAt : PlanFlags.None,
                    vertices = (float*)pins.Add(model.Vertices),
                    vertex_count = (ulong)Check.Groups(model.Vertices.Length, 3, "model.Vertices"),
                    triangles = (uint*)pins.Add(model.Triangles),
                    triangle_count =
                        (ulong)Check.Groups(model.Triangles.Length, 3, "model.Triangles"),
                    parts = (defrec_plan_part*)pins.Add(named),
                    part_count = (ulong)named.Length,
                    targets = (double*)pins.Add(targets),
                    target_count = (ulong)targetCount,
                    target_names = names.Length == 0 ? null : (byte**)pins.Add(names),
                };
                using (var surface = new HandleUse(template.Handle))
                using (var found = new HandleUse(registration.Handle))
                {
                    IntPtr native;
                    DefrecException.ThrowIfFailed(NativeMethods.defrec_plan_create(
                        surface.Native, found.Native, &desc, &native));
                    handle.Adopt(native);
                }
            }
            return Of(handle);
        }

        /// <summary>
        /// Reads a plan that <see cref="Save"/> has written for this template: the same object,
        /// what it became, one that was saved and loaded, or one of the same first view.
        /// </summary>
        /// <exception cref="ArgumentNullException">An argument is null.</exception>
        /// <exception cref="ObjectDisposedException">The template was disposed.</exception>
        /// <exception cref="DefrecException">
        /// The file cannot be read, or holds no plan (<see cref="Status.ErrorIo"/>); or it was made
        /// for another template (<see cref="Status.ErrorArgument"/>).
        /// </exception>
        public static Plan Load(Template template, string path)
        {
            Check.NotNull(template, nameof(template));
            Check.NotNull(path, nameof(path));
            var handle = new PlanHandle(template.Handle.Log);
            fixed (byte* file = Utf8.Bytes(path, nameof(path)))
            using (var use = new HandleUse(template.Handle))
            {
                IntPtr native;
                DefrecException.ThrowIfFailed(
                    NativeMethods.defrec_plan_load(use.Native, file, &native));
                handle.Adopt(native);
            }
            return Of(handle);
        }

        /// <summary>The registration's.</summary>
        public Verdict Verdict { get; private set; }
        /// <summary>Template frame from model frame.</summary>
        public RigidTransform Transform { get; private set; }
        /// <summary>Vertices of the model, which are the first points.</summary>
        public int VertexCount { get; private set; }
        /// <summary>Targets, which are the last points.</summary>
        public int TargetCount { get; private set; }
        /// <summary>Vertices and targets.</summary>
        public int PointCount { get; private set; }
        /// <summary>
        /// The registration deformed the model: <see cref="GetTemplateXyz"/> is not what
        /// <see cref="Transform"/> makes of it.
        /// </summary>
        public bool Deformed { get; private set; }
        /// <summary>Named parts of the model.</summary>
        public IReadOnlyList<PlanPart> Parts { get; private set; }
        /// <summary>Name of each target; "" for one without.</summary>
        public IReadOnlyList<string> TargetNames { get; private set; }

        /// <summary>
        /// Index of the point that is the target of that name; -1: there is none.
        /// </summary>
        /// <exception cref="ArgumentException">name is null or empty.</exception>
        public int PointOf(string name)
        {
            Check.NotNull(name, nameof(name));
            if (name.Length == 0) throw new ArgumentException("A name expected.", nameof(name));
            for (int i = 0; i < TargetNames.Count; ++i)
                if (TargetNames[i] == name) return VertexCount + i;
            return -1;
        }

        /// <summary>x, y, z of each point at rest, template frame, mm. A new array.</summary>
        /// <exception cref="ObjectDisposedException">The plan was disposed.</exception>
        public double[] GetTemplateXyz()
        {
            var copy = new double[Check.ArrayLength((ulong)PointCount, 3)];
            using (var use = new HandleUse(Handle))
            fixed (double* to = copy)
                NativeArray.Copy(Read(use).template_xyz, to, copy.Length, sizeof(double));
            return copy;
        }

        /// <summary>Target registration error of each point, mm. A new array.</summary>
        /// <exception cref="ObjectDisposedException">The plan was disposed.</exception>
        public double[] GetRegistrationErrorMm()
        {
            var copy = new double[PointCount];
            using (var use = new HandleUse(Handle))
            fixed (double* to = copy)
                NativeArray.Copy(Read(use).registration_error_mm, to, copy.Length, sizeof(double));
            return copy;
        }

        /// <summary>The model, model frame, mm. New arrays.</summary>
        /// <exception cref="ObjectDisposedException">The plan was disposed.</exception>
        public TriangleMesh GetModel()
        {
            using (var use = new HandleUse(Handle))
            {
                defrec_plan_info info = Read(use);
                var vertices = new float[Check.ArrayLength(info.vertex_count, 3)];
                var triangles = new uint[Check.ArrayLength(info.triangle_count, 3)];
                fixed (float* to = vertices)
                    NativeArray.Copy(info.vertices, to, vertices.Length, sizeof(float));
                fixed (uint* to = triangles)
                    NativeArray.Copy(info.triangles, to, triangles.Length, sizeof(uint));
                return new TriangleMesh(vertices, triangles);
            }
        }

        /// <summary>Writes the plan to a file that <see cref="Load"/> reads.</summary>
        /// <exception cref="ArgumentNullException">path is null.</exception>
        /// <exception cref="ObjectDisposedException">The plan was disposed.</exception>
        /// <exception cref="DefrecException">
        /// It cannot be written (<see cref="Status.ErrorIo"/>).
        /// </exception>
        public void Save(string path)
        {
            Check.NotNull(path, nameof(path));
            fixed (byte* file = Utf8.Bytes(path, nameof(path)))
            using (var use = new HandleUse(Handle))
                DefrecException.ThrowIfFailed(NativeMethods.defrec_plan_save(use.Native, file));
        }

        /// <summary>Ends the use of the plan.</summary>
        public void Dispose() { Handle.Dispose(); }

        // Owns the handle, also where it throws.
        private static Plan Of(PlanHandle handle)
        {
            var plan = new Plan(handle);
            try
            {
                using (var use = new HandleUse(handle)) plan.Take(Read(use));
                return plan;
            }
            catch
            {
                handle.Dispose();
                throw;
            }
        }

        private void Take(defrec_plan_info info)
        {
            Verdict = info.verdict;
            Transform = info.transform;
            VertexCount = Check.ArrayLength(info.vertex_count, 1);
            TargetCount = Check.ArrayLength(info.target_count, 1);
            PointCount = Check.ArrayLength(info.point_count, 1);
            Deformed = info.deformed != 0;
            var parts = new PlanPart[Check.ArrayLength(info.part_count, 1)];
            for (int i = 0; i < parts.Length; ++i)
                parts[i] = new PlanPart(
                    Utf8.Read(info.parts[i].name), checked((int)info.parts[i].first_triangle),
                    checked((int)info.parts[i].triangle_count));
            Parts = parts;
            var names = new string[TargetCount];
            for (int i = 0; i < names.Length; ++i) names[i] = Utf8.Read(info.target_names[i]);
            TargetNames = names;
        }

        private static defrec_plan_info Read(HandleUse use)
        {
            var info = new defrec_plan_info { struct_size = (uint)sizeof(defrec_plan_info) };
            DefrecException.ThrowIfFailed(NativeMethods.defrec_plan_get(use.Native, &info));
            return info;
        }
    }
}
