"""Calls of Embree, and numbers at addresses of memory that its calls back are given."""

from llvmlite import ir
from numba import types
from numba.extending import intrinsic


def _reader(kind, bits, floating):
    """Make a function that reads one number at an address."""

    @intrinsic
    def read(typing_context, address):
        def generate(context, builder, signature, arguments):
            form = ir.DoubleType() if floating else ir.IntType(bits)
            return builder.load(builder.inttoptr(arguments[0], form.as_pointer()))

        return kind(types.intp), generate

    return read


read_float64 = _reader(types.float64, 64, True)
read_int64 = _reader(types.int64, 64, False)
read_uint32 = _reader(types.uint32, 32, False)


@intrinsic
def write_int32(typing_context, address, value):
    """Write a whole number of 32 bits at an address."""

    def generate(context, builder, signature, arguments):
        form = ir.IntType(32)
        builder.store(
            builder.trunc(arguments[1], form),
            builder.inttoptr(arguments[0], form.as_pointer()),
        )
        return context.get_dummy_value()

    return types.void(types.intp, types.int64), generate


@intrinsic
def write_float64(typing_context, address, value):
    """Write a number at an address."""

    def generate(context, builder, signature, arguments):
        form = ir.DoubleType().as_pointer()
        builder.store(arguments[1], builder.inttoptr(arguments[0], form))
        return context.get_dummy_value()

    return types.void(types.intp, types.float64), generate


@intrinsic
def call_embree(typing_context, function, scene, ray, arguments):
    """Call the C function (scene, ray, arguments) at an address; all four are addresses."""

    def generate(context, builder, signature, given):
        pointer = ir.IntType(8).as_pointer()
        kind = ir.FunctionType(ir.VoidType(), [pointer, pointer, pointer])
        target = builder.inttoptr(given[0], kind.as_pointer())
        builder.call(target, [builder.inttoptr(one, pointer) for one in given[1:]])
        return context.get_dummy_value()

    return types.void(types.intp, types.intp, types.intp, types.intp), generate


@intrinsic
def call_embree_packet(typing_context, function, valid, scene, rays, arguments):
    """Call the C function (valid, scene, rays, arguments) at an address; all addresses."""

    def generate(context, builder, signature, given):
        pointer = ir.IntType(8).as_pointer()
        kind = ir.FunctionType(ir.VoidType(), [pointer, pointer, pointer, pointer])
        target = builder.inttoptr(given[0], kind.as_pointer())
        builder.call(target, [builder.inttoptr(one, pointer) for one in given[1:]])
        return context.get_dummy_value()

    return types.void(*[types.intp] * 5), generate
