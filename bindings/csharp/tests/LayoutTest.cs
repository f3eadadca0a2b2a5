using System;
using System.Collections.Generic;
using System.IO;
using System.Linq;
using System.Reflection;
using System.Runtime.CompilerServices;
using System.Runtime.InteropServices;
using System.Text.RegularExpressions;
using Defrec.Native;
using NUnit.Framework;
using RegexMatch = System.Text.RegularExpressions.Match;

namespace Defrec.Tests
{
    /// <summary>
    /// The binding's structs, enumerators and declarations against the lists that are generated
    /// from the headers: sdk/abi/layout.txt and sdk/abi/exports_libdefrec.txt. What only plugins
    /// see (names that defrec_c.h does not have) is left out.
    /// </summary>
    [TestFixture]
    public class LayoutTest
    {
        private static readonly Assembly Binding = typeof(Context).Assembly;
        private readonly string header = File.ReadAllText(TestPaths.Header);
        private readonly string[] layout = File.ReadAllLines(TestPaths.Layout);

        [Test]
        public void EveryStructHasTheSizeAndTheFieldsOfTheLibrary()
        {
            var fields = new Dictionary<string, List<string>>();
            var sizes = new Dictionary<string, int>();
            foreach (string line in layout)
            {
                RegexMatch field = Regex.Match(line, @"^(\w+)\.(\w+): (\d+) at (\d+)$");
                RegexMatch size = Regex.Match(line, @"^(\w+): (\d+) bytes$");
                string name = (field.Success ? field : size).Groups[1].Value;
                if (name == "" || !IsOfApplications(name)) continue;
                if (size.Success) sizes.Add(name, int.Parse(size.Groups[2].Value));
                if (!field.Success) continue;
                if (!fields.ContainsKey(name)) fields.Add(name, new List<string>());
                fields[name].Add(
                    field.Groups[2].Value + ": " + field.Groups[3].Value + " at " +
                    field.Groups[4].Value);
            }
            Assert.That(fields.Count, Is.GreaterThan(30));
            Assert.That(sizes.Count, Is.GreaterThan(10));
            foreach (string name in fields.Keys)
            {
                Type type = TypeOf(name);
                Assert.That(Describe(type), Is.EqualTo(fields[name]), name);
                Assert.That(IsBlittable(type), name + " is plain memory");
                if (sizes.ContainsKey(name))
                    Assert.That(Marshal.SizeOf(type), Is.EqualTo(sizes[name]), name);
            }
            foreach (string name in sizes.Keys) Assert.That(fields.ContainsKey(name), name);
        }

        [Test]
        public void EveryStructOfTheBindingIsOneOfTheLibrary()
        {
            var known = new HashSet<Type>(
                layout.Select(line => Regex.Match(line, @"^(\w+)\.").Groups[1].Value)
                    .Where(name => name != "" && IsOfApplications(name))
                    .Select(TypeOf));
            // Parts of others; "defrec_stage_times" and the vectors are arrays in C.
            var parts = new HashSet<Type> {
                typeof(defrec_stage_times),
                typeof(Float3),
                typeof(Float4),
                typeof(Int4),
                typeof(Float3x3),
                typeof(Descriptor),
                typeof(RigidTransform),
            };
            foreach (Type type in Binding.GetTypes())
            {
                if (!type.Name.StartsWith("defrec_") && !type.Name.EndsWith("Parameters")) continue;
                Assert.That(known.Contains(type) || parts.Contains(type), type.FullName);
            }
        }

        [Test]
        public void EveryEnumeratorHasTheValueOfTheLibrary()
        {
            int count = 0;
            foreach (string line in layout)
            {
                RegexMatch match = Regex.Match(line, @"^DEFREC_(\w+) = (-?\d+)$");
                if (!match.Success || !IsOfApplications("DEFREC_" + match.Groups[1].Value))
                    continue;
                Assert.That(
                    ValueOf(match.Groups[1].Value), Is.EqualTo(long.Parse(match.Groups[2].Value)),
                    line);
                ++count;
            }
            Assert.That(count, Is.GreaterThan(70));
        }

        [Test]
        public void TheBindingHasNoEnumeratorThatTheLibraryHasNot()
        {
            var ofLibrary = layout.Select(line => Regex.Match(line, @"^DEFREC_(\w+) = "))
                                .Where(match => match.Success)
                                .Select(match => EnumeratorOf(match.Groups[1].Value))
                                .ToList();
            // Zeros, the mask of stages and the API's version are not enumerators in C.
            var own = new HashSet<string> { "None", "Default" };
            foreach (Type type in Binding.GetTypes().Where(
                         type => type.IsEnum && type != typeof(StageMask)))
            {
                foreach (string name in Enum.GetNames(type).Where(name => !own.Contains(name)))
                    Assert.That(
                        ofLibrary, Contains.Item(new KeyValuePair<Type, string>(type, name)));
            }
        }

        [Test]
        public void TheMaskOfStagesHasABitForEach()
        {
            foreach (StageKind stage in Enum.GetValues(typeof(StageKind)))
                Assert.That(
                    (uint)Enum.Parse(typeof(StageMask), stage.ToString()),
                    Is.EqualTo(1u << (int)stage), stage.ToString());
            Assert.That((uint)StageMask.All, Is.EqualTo((1u << Constants.StageCountV1) - 1));
        }

        [Test]
        public void TheVersionIsTheHeaders()
        {
            Assert.That(
                Regex.Match(header, @"#define DEFREC_API_MAJOR (\d+)").Groups[1].Value,
                Is.EqualTo(Constants.ApiMajor.ToString()));
            Assert.That(
                Regex.Match(header, @"#define DEFREC_API_MINOR (\d+)").Groups[1].Value,
                Is.EqualTo(Constants.ApiMinor.ToString()));
        }

        [Test]
        public void EveryFieldOfTheLibraryIsOffered()
        {
            IsOffered(typeof(defrec_result), typeof(FrameSummary), typeof(FrameResult));
            IsOffered(typeof(defrec_tracker_desc), typeof(TrackerOptions));
            IsOffered(typeof(defrec_device_info), typeof(DeviceInfo));
            IsOffered(typeof(defrec_plugin_info), typeof(PluginInfo));
        }

        private static void IsOffered(Type native, params Type[] types)
        {
            // The length of an array is the array's; flags are properties of their own.
            var hidden = new[] { "struct_size", "reserved", "reserved2", "flags", "time_count" };
            List<string> properties = types.SelectMany(type => type.GetProperties())
                                          .Select(property => property.Name)
                                          .ToList();
            foreach (FieldInfo field in FieldsOf(native).Where(
                         field => !hidden.Contains(field.Name)))
                Assert.That(
                    properties, Contains.Item(Pascal(field.Name)), native.Name + "." + field.Name);
        }

        [Test]
        public void NumbersOfAResultKeepTheirNames()
        {
            object numbers = new defrec_result();
            var fields = new List<FieldInfo>();
            var properties = new List<PropertyInfo>();
            foreach (FieldInfo field in FieldsOf(typeof(defrec_result)))
            {
                PropertyInfo property = typeof(FrameSummary).GetProperty(Pascal(field.Name));
                if (property == null || field.FieldType == typeof(RigidTransform)) continue;
                fields.Add(field);
                properties.Add(property);
                Type type = field.FieldType;
                field.SetValue(
                    numbers, type.IsEnum ? Enum.ToObject(type, fields.Count)
                                         : Convert.ChangeType(fields.Count, type));
            }
            Assert.That(fields.Count, Is.GreaterThan(15));
            var result = (defrec_result)numbers;
            var summary = new FrameSummary(ref result);
            for (int i = 0; i < fields.Count; ++i)
                Assert.That(
                    Convert.ToInt32(properties[i].GetValue(summary, null)), Is.EqualTo(i + 1),
                    fields[i].Name);
        }

        [Test]
        public unsafe void ArraysOfAResultKeepTheirNames()
        {
            // Elements of every array have bytes of its own, and counts differ.
            var given = new defrec_result();
            Func<FieldInfo, int> placeOf = field =>
                (int)Marshal.OffsetOf(typeof(defrec_result), field.Name);
            FieldInfo[] pointers =
                FieldsOf(typeof(defrec_result))
                    .Where(field => field.FieldType.IsPointer && field.Name != "device_id")
                    .ToArray();
            IEnumerable<FieldInfo> counts =
                FieldsOf(typeof(defrec_result))
                    .Where(
                        field => field.Name.EndsWith("_count") && field.FieldType == typeof(ulong));
            ulong count = 2;
            foreach (FieldInfo field in counts) *(ulong*)((byte*)&given + placeOf(field)) = count++;
            const int size = 1 << 12;
            byte* memory = stackalloc byte[pointers.Length * size];
            for (int i = 0; i < pointers.Length * size; ++i) memory[i] = (byte)(i / size + 1);
            for (int i = 0; i < pointers.Length; ++i)
                *(byte**)((byte*)&given + placeOf(pointers[i])) = memory + i * size;
            var result = new FrameResult();
            result.Fill(ref given, 42);
            Assert.That(pointers.Length, Is.GreaterThan(10));
            for (int i = 0; i < pointers.Length; ++i)
            {
                var array = (Array) typeof(FrameResult)
                                .GetProperty(Pascal(pointers[i].Name))
                                .GetValue(result, null);
                Assert.That(array.Length, Is.GreaterThan(1), pointers[i].Name);
                GCHandle pinned = GCHandle.Alloc(array, GCHandleType.Pinned);
                Type element = array.GetType().GetElementType();
                var bytes = new byte[array.Length * SizeOf(element)];
                Marshal.Copy(pinned.AddrOfPinnedObject(), bytes, 0, bytes.Length);
                pinned.Free();
                Assert.That(bytes, Has.All.EqualTo(i + 1), pointers[i].Name);
                Assert.That(
                    typeof(Job).GetMethod(
                        "Copy" + Pascal(pointers[i].Name), new[] { array.GetType() }),
                    Is.Not.Null, pointers[i].Name);
            }
            Assert.That(result.Vertices.Length, Is.EqualTo(3 * result.Summary.VertexCount));
            Assert.That(result.VertexCovariance.Length, Is.EqualTo(6 * result.Summary.VertexCount));
            Assert.That(result.LandmarkMatches.Length, Is.EqualTo(result.Summary.LandmarkCount));
            Assert.That(result.Disparity.Length, Is.EqualTo(42));
        }

        [Test]
        public void EveryExportedFunctionIsDeclaredOnceAndNoOther()
        {
            MethodInfo[] declared =
                Binding.GetTypes()
                    .SelectMany(
                        type => type.GetMethods(
                            BindingFlags.Static | BindingFlags.Instance | BindingFlags.Public |
                            BindingFlags.NonPublic | BindingFlags.DeclaredOnly))
                    .Where(method => (method.Attributes & MethodAttributes.PinvokeImpl) != 0)
                    .ToArray();
            Assert.That(
                declared.Select(method => method.Name)
                    .OrderBy(name => name, StringComparer.Ordinal),
                Is.EqualTo(File.ReadAllLines(TestPaths.Exports)
                               .OrderBy(name => name, StringComparer.Ordinal)));
            foreach (MethodInfo method in declared)
            {
                var import = (DllImportAttribute)Attribute.GetCustomAttribute(
                    method, typeof(DllImportAttribute));
                Assert.That(import.Value, Is.EqualTo(NativeMethods.Library), method.Name);
                Assert.That(
                    import.CallingConvention, Is.EqualTo(CallingConvention.Cdecl), method.Name);
                Assert.That(import.SetLastError, Is.False, method.Name);
                foreach (Type type in method.GetParameters().Select(
                             parameter => parameter.ParameterType))
                    Assert.That(IsBlittable(type), method.Name + ": " + type);
                Assert.That(
                    method.ReturnType == typeof(void) || IsBlittable(method.ReturnType),
                    method.Name);
            }
        }

        [Test]
        public void EveryFunctionIsOffered()
        {
            IEnumerable<string> called =
                Methods()
                    .SelectMany(CallsOf)
                    .Where(target => target.DeclaringType == typeof(NativeMethods))
                    .Select(target => target.Name);
            Assert.That(
                called.Distinct().OrderBy(name => name, StringComparer.Ordinal),
                Is.EqualTo(File.ReadAllLines(TestPaths.Exports)));
        }

        [Test]
        public void EveryStatusIsLookedAt()
        {
            int count = 0;
            foreach (MethodBase method in Methods())
            {
                List<MethodInfo> calls = CallsOf(method).OfType<MethodInfo>().ToList();
                int answers = calls.Count(
                    target => target.DeclaringType == typeof(NativeMethods) &&
                              target.ReturnType == typeof(Status));
                bool handsOn =
                    method is MethodInfo && ((MethodInfo)method).ReturnType == typeof(Status);
                bool throws = calls.Any(target => target.Name == "ThrowIfFailed");
                Assert.That(
                    answers == 0 || throws || handsOn, method.DeclaringType + "." + method.Name);
                count += answers;
            }
            Assert.That(count, Is.GreaterThan(20));
        }

        private static IEnumerable<MethodBase> Methods()
        {
            const BindingFlags all = BindingFlags.Static | BindingFlags.Instance |
                                     BindingFlags.Public | BindingFlags.NonPublic |
                                     BindingFlags.DeclaredOnly;
            return Binding.GetTypes().SelectMany(
                type => type.GetMethods(all).Concat<MethodBase>(type.GetConstructors(all)));
        }

        // The methods of the binding that a method calls.
        private static IEnumerable<MethodBase> CallsOf(MethodBase method)
        {
            const byte call = 0x28; // followed by the method's token
            byte[] code = method.GetMethodBody() == null
                              ? new byte[0]
                              : method.GetMethodBody().GetILAsByteArray();
            for (int i = 0; i + 4 < code.Length; ++i)
            {
                if (code[i] != call) continue;
                MethodBase target = null;
                try
                {
                    target =
                        Binding.ManifestModule.ResolveMethod(BitConverter.ToInt32(code, i + 1));
                }
                catch (ArgumentException)
                {
                } // not a call, but a part of another instruction
                if (target != null && target.Module == Binding.ManifestModule) yield return target;
            }
        }

        private bool IsOfApplications(string name)
        {
            return Regex.IsMatch(header, @"\b" + name + @"\b");
        }

        private static string Pascal(string name)
        {
            return string.Concat(name.Split('_').Select(
                part => part.Substring(0, 1).ToUpperInvariant() +
                        part.Substring(1).ToLowerInvariant()));
        }

        private static Type TypeOf(string name)
        {
            string plain = Regex.Replace(
                name, "^defrec_(.*?)(_params)?$",
                match => match.Groups[1].Value + (match.Groups[2].Success ? "_parameters" : ""));
            Type type = Binding.GetType("Defrec.Native." + name) ??
                        Binding.GetType("Defrec." + Pascal(plain));
            Assert.That(type, Is.Not.Null, name + " has no struct");
            return type;
        }

        private static FieldInfo[] FieldsOf(Type type)
        {
            return type.GetFields(
                BindingFlags.Instance | BindingFlags.Public | BindingFlags.NonPublic);
        }

        private static List<string> Describe(Type type)
        {
            return FieldsOf(type)
                .Select(
                    field => Snake(field.Name) + ": " + SizeOf(field) + " at " +
                             Marshal.OffsetOf(type, field.Name))
                .ToList();
        }

        internal static string Snake(string name)
        {
            return Regex.Replace(name, "(?<=.)([A-Z])", "_$1").ToLowerInvariant();
        }

        private static int SizeOf(FieldInfo field)
        {
            var array = (FixedBufferAttribute)Attribute.GetCustomAttribute(
                field, typeof(FixedBufferAttribute));
            return array != null ? array.Length * SizeOf(array.ElementType)
                                 : SizeOf(field.FieldType);
        }

        private static int SizeOf(Type type)
        {
            if (type.IsPointer) return IntPtr.Size;
            return Marshal.SizeOf(type.IsEnum ? Enum.GetUnderlyingType(type) : type);
        }

        private static bool IsBlittable(Type type)
        {
            if (type.IsPointer || type.IsEnum || type == typeof(IntPtr) || type == typeof(UIntPtr))
                return true;
            if (type.IsPrimitive) return type != typeof(bool) && type != typeof(char);
            return type.IsValueType && type.IsLayoutSequential &&
                   FieldsOf(type).All(field => IsBlittable(field.FieldType));
        }

        private static readonly KeyValuePair<string, Type>[] Enums = {
            new KeyValuePair<string, Type>("LOG_", typeof(LogLevel)),
            new KeyValuePair<string, Type>("CONTEXT_", typeof(ContextFlags)),
            new KeyValuePair<string, Type>("DEVICE_", typeof(DeviceKind)),
            new KeyValuePair<string, Type>("STAGE_COUNT_V1", typeof(Constants)),
            new KeyValuePair<string, Type>("STAGE_", typeof(StageKind)),
            new KeyValuePair<string, Type>("FEATURE_", typeof(DeviceFeatures)),
            new KeyValuePair<string, Type>("MEMORY_", typeof(MemoryKind)),
            new KeyValuePair<string, Type>("FORMAT_", typeof(PixelFormat)),
            new KeyValuePair<string, Type>("SCAN_", typeof(Scan)),
            new KeyValuePair<string, Type>("FIELD_", typeof(FrameField)),
            new KeyValuePair<string, Type>("SOLVER_", typeof(Solver)),
            new KeyValuePair<string, Type>("SELF_CALIBRATION_", typeof(SelfCalibration)),
            new KeyValuePair<string, Type>("EVIDENCE_", typeof(Evidence)),
            new KeyValuePair<string, Type>("FOUND_", typeof(Found)),
            new KeyValuePair<string, Type>("BODY_STATE_", typeof(BodyState)),
            new KeyValuePair<string, Type>("BODY_", typeof(BodyMode)),
            new KeyValuePair<string, Type>("REGION_", typeof(RegionFlags)),
            new KeyValuePair<string, Type>("VERDICT_", typeof(Verdict)),
            new KeyValuePair<string, Type>("DEFORMATION_", typeof(Deformation)),
            new KeyValuePair<string, Type>("FREE_", typeof(FreeMotionKind)),
            new KeyValuePair<string, Type>("REGISTRATION_", typeof(RegistrationFlags)),
            new KeyValuePair<string, Type>("PLAN_", typeof(PlanFlags)),
            new KeyValuePair<string, Type>("HAND_EYE_", typeof(HandEyeFlags)),
            new KeyValuePair<string, Type>("PREDICTED_", typeof(PredictionBasis)),
            new KeyValuePair<string, Type>("FRAME_", typeof(FrameFlags)),
            new KeyValuePair<string, Type>("REASON_", typeof(Reasons)),
            new KeyValuePair<string, Type>("VIEW_", typeof(Views)),
            new KeyValuePair<string, Type>("POINT_", typeof(PointStatus)),
        };
        // Those that C has without a common beginning.
        private static readonly Type[] Unnamed = {
            typeof(Status), typeof(FrameState), typeof(Observation)
        };

        // Type and name of DEFREC_<name> in the binding.
        private static KeyValuePair<Type, string> EnumeratorOf(string name)
        {
            foreach (KeyValuePair<string, Type> known in Enums)
            {
                if (!name.StartsWith(known.Key)) continue;
                string rest =
                    known.Value == typeof(Constants) ? name : name.Substring(known.Key.Length);
                return new KeyValuePair<Type, string>(known.Value, Pascal(rest));
            }
            Type type = Unnamed.FirstOrDefault(
                            candidate => Enum.GetNames(candidate).Contains(Pascal(name))) ??
                        typeof(Constants);
            return new KeyValuePair<Type, string>(type, Pascal(name));
        }

        private static long ValueOf(string name)
        {
            KeyValuePair<Type, string> enumerator = EnumeratorOf(name);
            if (enumerator.Key == typeof(Constants))
            {
                FieldInfo constant = typeof(Constants).GetField(enumerator.Value);
                Assert.That(constant, Is.Not.Null, "DEFREC_" + name + " has no constant");
                return (int)constant.GetRawConstantValue();
            }
            Assert.That(
                Enum.GetNames(enumerator.Key), Contains.Item(enumerator.Value), "DEFREC_" + name);
            return Convert.ToInt64(Enum.Parse(enumerator.Key, enumerator.Value));
        }
    }
}
