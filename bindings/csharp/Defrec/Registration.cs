using System;
using Defrec.Native;

namespace Defrec
{
    /// <summary>
    /// Where a preoperative model lies. Model frame: that of the model, such as a scan's. Seen
    /// frame: that of what was seen, normally the template frame. What fits nowhere, in several
    /// places or leaves a motion open throws nothing: <see cref="Verdict"/> says so. Any thread.
    /// </summary>
    public sealed unsafe class Registration : IDisposable
    {
        internal readonly RegistrationHandle Handle;
        private readonly double[] covariance = new double[36];

        private Registration(RegistrationHandle handle) { Handle = handle; }

        /// <summary>Registers by pairs of places.</summary>
        /// <exception cref="ArgumentException">
        /// pairs or an array of it is null, or arrays have different lengths.
        /// </exception>
        /// <exception cref="DefrecException">
        /// There are fewer than 3, a number is not finite or out of its range, or a covariance is
        /// none (<see cref="Status.ErrorArgument"/>).
        /// </exception>
        public static Registration FromPairs(PointPairs pairs)
        {
            Check.NotNull(pairs, nameof(pairs));
            Check.NotNull(pairs.ModelXyz, "pairs.ModelXyz");
            Check.NotNull(pairs.SeenXyz, "pairs.SeenXyz");
            int count = Check.Groups(pairs.ModelXyz.Length, 3, "pairs.ModelXyz");
            SameLength(pairs.SeenXyz, 3, count, "pairs.SeenXyz");
            SameLength(pairs.ModelCovariance, 6, count, "pairs.ModelCovariance");
            SameLength(pairs.SeenCovariance, 6, count, "pairs.SeenCovariance");
            var handle = new RegistrationHandle(null);
            using (var pins = new Pins())
            {
                var desc = new defrec_registration_pairs {
                    struct_size = (uint)sizeof(defrec_registration_pairs),
                    model_xyz = (double*)pins.Add(pairs.ModelXyz),
                    seen_xyz = (double*)pins.Add(pairs.SeenXyz),
                    model_covariance = (double*)pins.Add(pairs.ModelCovariance),
                    seen_covariance = (double*)pins.Add(pairs.SeenCovariance),
                    count = (ulong)count,
                    max_residual_mm = pairs.MaxResidualMm,
                    max_error_mm = pairs.MaxErrorMm,
                };
                IntPtr native;
                DefrecException.ThrowIfFailed(
                    NativeMethods.defrec_registration_from_pairs(&desc, &native));
                handle.Adopt(native);
            }
            return Of(handle);
        }

        /// <summary>
        /// Registers a model's surface (model frame) to points that were seen of it. options null:
        /// all defaults.
        /// </summary>
        /// <exception cref="ArgumentException">
        /// An argument or an array is null, or arrays have lengths that do not fit together.
        /// </exception>
        /// <exception cref="ObjectDisposedException">The context was disposed.</exception>
        /// <exception cref="DefrecException">
        /// The model is none, or a number is not finite or out of its range
        /// (<see cref="Status.ErrorArgument"/>).
        /// </exception>
        public static Registration FromSurface(
            Context context, TriangleMesh model, SeenSurface seen,
            RegistrationOptions options = null)
        {
            Check.NotNull(context, nameof(context));
            Check.NotNull(seen, nameof(seen));
            Check.NotNull(seen.Vertices, "seen.Vertices");
            int count = Check.Groups(seen.Vertices.Length, 3, "seen.Vertices");
            SameLength(seen.Normals, 3, count, "seen.Normals");
            SameLength(seen.Covariances, 6, count, "seen.Covariances");
            SameLength(seen.Status, 1, count, "seen.Status");
            var handle = new RegistrationHandle(context.Handle.Log);
            using (var pins = new Pins())
            {
                defrec_registration_desc desc = Describe(model, options, pins);
                desc.seen_vertices = (float*)pins.Add(seen.Vertices);
                desc.seen_normals = (float*)pins.Add(seen.Normals);
                desc.seen_covariances = (float*)pins.Add(seen.Covariances);
                desc.seen_status = (byte*)pins.Add(seen.Status);
                desc.seen_count = (ulong)count;
                using (var use = new HandleUse(context.Handle))
                {
                    IntPtr native;
                    DefrecException.ThrowIfFailed(
                        NativeMethods.defrec_registration_from_surface(use.Native, &desc, &native));
                    handle.Adopt(native);
                }
            }
            return Of(handle);
        }

        /// <summary>
        /// Registers a model's surface (model frame) to the vertices of a template whose depth was
        /// measured, with the errors that stereo leaves, or
        /// <see cref="RegistrationOptions.PointErrorMm"/> where that is given. options null: all
        /// defaults.
        /// </summary>
        /// <exception cref="ArgumentException">An argument or an array is null.</exception>
        /// <exception cref="ObjectDisposedException">
        /// The context or the template was disposed.
        /// </exception>
        /// <exception cref="DefrecException">
        /// The model is none, or a number is not finite or out of its range
        /// (<see cref="Status.ErrorArgument"/>).
        /// </exception>
        public static Registration FromTemplate(
            Context context, Template template, TriangleMesh model,
            RegistrationOptions options = null)
        {
            Check.NotNull(context, nameof(context));
            Check.NotNull(template, nameof(template));
            var handle = new RegistrationHandle(context.Handle.Log);
            using (var pins = new Pins())
            {
                defrec_registration_desc desc = Describe(model, options, pins);
                using (var owner = new HandleUse(context.Handle))
                using (var surface = new HandleUse(template.Handle))
                {
                    IntPtr native;
                    DefrecException.ThrowIfFailed(NativeMethods.defrec_registration_from_template(
                        owner.Native, surface.Native, &desc, &native));
                    handle.Adopt(native);
                }
            }
            return Of(handle);
        }

        /// <summary>
        /// Use nothing else but <see cref="Defrec.Verdict.Accepted"/> without a person's look.
        /// </summary>
        public Verdict Verdict { get; private set; }
        /// <summary>The verdict's, one sentence for people.</summary>
        public string Reason { get; private set; }
        /// <summary>
        /// Seen frame from model frame; of a failed one the best pose that was found, of a deformed
        /// model the rigid part of its motion.
        /// </summary>
        public RigidTransform Transform { get; private set; }
        /// <summary>Root mean square of the inliers' residuals, mm.</summary>
        public double RmsMm { get; private set; }
        /// <summary>Robust standard deviation of all residuals, mm.</summary>
        public double RobustMm { get; private set; }
        /// <summary>That of the residuals in units of their expected errors.</summary>
        public double ErrorRatio { get; private set; }
        /// <summary>0 to 1 of what was compared.</summary>
        public double InlierShare { get; private set; }
        /// <summary>So many neighbours share an error.</summary>
        public double Correlated { get; private set; }
        /// <summary>Points or pairs that were compared.</summary>
        public int Used { get; private set; }
        /// <summary>Points or pairs that were given; of a template its vertices.</summary>
        public int PointCount { get; private set; }
        /// <summary>Triangles of the model that have an area.</summary>
        public int TriangleCount { get; private set; }
        /// <summary>Triangles of the model without an area.</summary>
        public int DroppedTriangles { get; private set; }
        /// <summary>Edges of one triangle: the model is not closed.</summary>
        public int OpenEdges { get; private set; }
        /// <summary>Edges of more than two triangles, or of two that turn differently.</summary>
        public int OddEdges { get; private set; }
        /// <summary>The model was inside out.</summary>
        public bool ModelTurned { get; private set; }
        /// <summary>It tells its outside, so that its back is not taken for its front.</summary>
        public bool ModelHasOutside { get; private set; }
        /// <summary>Motions that the data leave open.</summary>
        public int FreeMotionCount { get; private set; }
        /// <summary>Other poses that fit about as well.</summary>
        public int AlternativeCount { get; private set; }
        /// <summary>Whether the model was deformed.</summary>
        public Deformation Deformation { get; private set; }
        /// <summary>Why, one sentence for people; "" where none was asked for.</summary>
        public string DeformationText { get; private set; }
        /// <summary>
        /// Root mean square displacement of the model's vertices against the transform, mm; this
        /// and the next two 0 where the model was not deformed.
        /// </summary>
        public double DeformedRmsMm { get; private set; }
        /// <summary>The largest displacement, mm.</summary>
        public double DeformedMaxMm { get; private set; }
        /// <summary>
        /// The largest share by which the body is stretched or compressed along a direction.
        /// </summary>
        public double LargestStrain { get; private set; }
        /// <summary>RmsMm before the deformation, of the rigid motion.</summary>
        public double RigidRmsMm { get; private set; }
        /// <summary>Likewise RobustMm.</summary>
        public double RigidRobustMm { get; private set; }

        /// <summary>
        /// 6x6 row by row, of the motion that the true transform has after this one: a turn about
        /// x, y, z of the seen frame and about its origin, rad, then a shift, mm. A new array.
        /// </summary>
        public double[] GetCovariance() { return (double[])covariance.Clone(); }

        /// <summary>
        /// mm, per point or pair given: along the model's outside normal, of a pair its length; NaN
        /// where it was not compared. A new array.
        /// </summary>
        /// <exception cref="ObjectDisposedException">The registration was disposed.</exception>
        public float[] GetResiduals()
        {
            var copy = new float[PointCount];
            using (var use = new HandleUse(Handle))
            fixed (float* to = copy)
                NativeArray.Copy(Read(use).residuals, to, copy.Length, sizeof(float));
            return copy;
        }

        /// <summary>Per point or pair given: it fits. A new array.</summary>
        /// <exception cref="ObjectDisposedException">The registration was disposed.</exception>
        public bool[] GetInliers()
        {
            var copy = new bool[PointCount];
            using (var use = new HandleUse(Handle))
            fixed (bool* to = copy)
                NativeArray.Copy(Read(use).inliers, to, copy.Length, sizeof(byte));
            return copy;
        }

        /// <summary>
        /// Three vertex indices each: triangles of the model that have an area, turned outwards. A
        /// new array.
        /// </summary>
        /// <exception cref="ObjectDisposedException">The registration was disposed.</exception>
        public uint[] GetTriangles()
        {
            var copy = new uint[Check.ArrayLength((ulong)TriangleCount, 3)];
            using (var use = new HandleUse(Handle))
            fixed (uint* to = copy)
                NativeArray.Copy(Read(use).triangles, to, copy.Length, sizeof(uint));
            return copy;
        }

        /// <summary>Motions that the data leave open. A new array.</summary>
        /// <exception cref="ObjectDisposedException">The registration was disposed.</exception>
        public FreeMotion[] GetFreeMotions()
        {
            var made = new FreeMotion[FreeMotionCount];
            using (var use = new HandleUse(Handle))
                for (int i = 0; i < made.Length; ++i)
                {
                    var motion =
                        new defrec_free_motion { struct_size = (uint)sizeof(defrec_free_motion) };
                    DefrecException.ThrowIfFailed(NativeMethods.defrec_registration_get_free_motion(
                        use.Native, (UIntPtr)(uint)i, &motion));
                    made[i] = new FreeMotion(ref motion);
                }
            return made;
        }

        /// <summary>Other poses that fit about as well, the best one first. A new array.</summary>
        /// <exception cref="ObjectDisposedException">The registration was disposed.</exception>
        public AlternativePose[] GetAlternatives()
        {
            var made = new AlternativePose[AlternativeCount];
            using (var use = new HandleUse(Handle))
                for (int i = 0; i < made.Length; ++i)
                {
                    var other = new defrec_registration_alternative {
                        struct_size = (uint)sizeof(defrec_registration_alternative)
                    };
                    DefrecException.ThrowIfFailed(NativeMethods.defrec_registration_get_alternative(
                        use.Native, (UIntPtr)(uint)i, &other));
                    made[i] = new AlternativePose(ref other);
                }
            return made;
        }

        /// <summary>
        /// Moves points (x, y, z, x, ...) of the model frame, mm, to the seen frame. covariance: of
        /// each xx, xy, xz, yy, yz, zz of the error, mm^2; expectedErrorMm: the target registration
        /// error, the root of its trace; either may be null. A point that is not finite comes out
        /// as NaN. modelXyz and xyz may be the same array.
        /// </summary>
        /// <exception cref="ArgumentException">
        /// modelXyz or xyz is null, modelXyz not a multiple of 3 long, or an array too short.
        /// </exception>
        /// <exception cref="ObjectDisposedException">The registration was disposed.</exception>
        public void MovePoints(
            double[] modelXyz, double[] xyz, double[] covariance = null,
            double[] expectedErrorMm = null)
        {
            Check.NotNull(modelXyz, nameof(modelXyz));
            Check.NotNull(xyz, nameof(xyz));
            int count = Check.Groups(modelXyz.Length, 3, nameof(modelXyz));
            Check.Length(xyz.Length, 3L * count, nameof(xyz));
            if (covariance != null) Check.Length(covariance.Length, 6L * count, nameof(covariance));
            if (expectedErrorMm != null)
                Check.Length(expectedErrorMm.Length, count, nameof(expectedErrorMm));
            using (var use = new HandleUse(Handle))
            {
                if (count == 0) return;
                fixed (double* from = modelXyz, to = xyz, errors = covariance,
                       expected = expectedErrorMm)
                    DefrecException.ThrowIfFailed(NativeMethods.defrec_registration_move_points(
                        use.Native, from, (UIntPtr)(uint)count, to, errors, expected));
            }
        }

        /// <summary>Ends the use of the registration.</summary>
        public void Dispose() { Handle.Dispose(); }

        // Owns the handle, also where it throws.
        private static Registration Of(RegistrationHandle handle)
        {
            var registration = new Registration(handle);
            try
            {
                using (var use = new HandleUse(handle)) registration.Take(Read(use));
                return registration;
            }
            catch
            {
                handle.Dispose();
                throw;
            }
        }

        private void Take(defrec_registration_info info)
        {
            Verdict = info.verdict;
            Reason = Utf8.Read(info.reason);
            Transform = info.transform;
            for (int i = 0; i < covariance.Length; ++i) covariance[i] = info.covariance[i];
            RmsMm = info.rms_mm;
            RobustMm = info.robust_mm;
            ErrorRatio = info.error_ratio;
            InlierShare = info.inlier_share;
            Correlated = info.correlated;
            Used = Check.ArrayLength(info.used, 1);
            PointCount = Check.ArrayLength(info.point_count, 1);
            TriangleCount = Check.ArrayLength(info.triangle_count, 1);
            DroppedTriangles = Check.ArrayLength(info.dropped_triangles, 1);
            OpenEdges = Check.ArrayLength(info.open_edges, 1);
            OddEdges = Check.ArrayLength(info.odd_edges, 1);
            ModelTurned = info.model_turned != 0;
            ModelHasOutside = info.model_has_outside != 0;
            FreeMotionCount = Check.ArrayLength(info.free_motion_count, 1);
            AlternativeCount = Check.ArrayLength(info.alternative_count, 1);
            Deformation = info.deformation;
            DeformationText = Utf8.Read(info.deformation_text);
            DeformedRmsMm = info.deformed_rms_mm;
            DeformedMaxMm = info.deformed_max_mm;
            LargestStrain = info.largest_strain;
            RigidRmsMm = info.rigid_rms_mm;
            RigidRobustMm = info.rigid_robust_mm;
        }

        private static defrec_registration_info Read(HandleUse use)
        {
            var info = new defrec_registration_info {
                struct_size = (uint)sizeof(defrec_registration_info)
            };
            DefrecException.ThrowIfFailed(NativeMethods.defrec_registration_get(use.Native, &info));
            return info;
        }

        private static defrec_registration_desc Describe(
            TriangleMesh model, RegistrationOptions options, Pins pins)
        {
            Check.NotNull(model, nameof(model));
            Check.NotNull(model.Vertices, "model.Vertices");
            Check.NotNull(model.Triangles, "model.Triangles");
            var desc = new defrec_registration_desc {
                struct_size = (uint)sizeof(defrec_registration_desc),
                model_vertices = (float*)pins.Add(model.Vertices),
                model_vertex_count =
                    (ulong)Check.Groups(model.Vertices.Length, 3, "model.Vertices"),
                model_triangles = (uint*)pins.Add(model.Triangles),
                model_triangle_count =
                    (ulong)Check.Groups(model.Triangles.Length, 3, "model.Triangles"),
            };
            if (options == null) return desc;
            if (options.NoCamera) desc.flags |= RegistrationFlags.NoCamera;
            if (options.Elastic) desc.flags |= RegistrationFlags.Elastic;
            desc.deformation_mm = options.DeformationMm;
            desc.start = options.Start;
            desc.viewer[0] = options.Viewer.X;
            desc.viewer[1] = options.Viewer.Y;
            desc.viewer[2] = options.Viewer.Z;
            desc.max_turn_rad = options.MaxTurnRad;
            desc.max_shift_mm = options.MaxShiftMm;
            desc.starts = checked((uint)options.Starts);
            desc.point_error_mm = options.PointErrorMm;
            desc.model_error_mm = options.ModelErrorMm;
            desc.max_residual_mm = options.MaxResidualMm;
            desc.min_inlier_share = options.MinInlierShare;
            desc.max_error_mm = options.MaxErrorMm;
            return desc;
        }

        // An array that is null has any length.
        private static void SameLength(Array array, int components, int count, string name)
        {
            if (array != null && array.Length != (long)components * count)
                throw new ArgumentException(
                    "The length is " + array.Length + "; " + (long)components * count +
                        " expected.",
                    name);
        }
    }
}
