"""First words of streams, the jumps by powers of the generator's 256 x 256 bit matrix.

python streams.py > streams.txt

Nothing of the jump polynomials is used: T^(2^128) and T^(2^192) by repeated squaring over GF(2).
"""

MASK = 2**64 - 1


def rotl(x, k):
    return ((x << k) | (x >> (64 - k))) & MASK


def step(s):
    s0, s1, s2, s3 = s
    t = (s1 << 17) & MASK
    s2 ^= s0
    s3 ^= s1
    s1 ^= s2
    s0 ^= s3
    s2 ^= t
    return s0, s1, s2, rotl(s3, 45)


def output(s):
    return (rotl((s[0] + s[3]) & MASK, 23) + s[0]) & MASK


def pack(s):
    return s[0] | s[1] << 64 | s[2] << 128 | s[3] << 192


def unpack(x):
    return tuple(x >> 64 * i & MASK for i in range(4))


def apply(matrix, x):
    """A matrix is the list of its images of single bits."""
    out = 0
    for i in range(256):
        if x >> i & 1:
            out ^= matrix[i]
    return out


def square(m):
    return [apply(m, column) for column in m]


def splitmix(seed):
    words = []
    for _ in range(4):
        seed = (seed + 0x9E3779B97F4A7C15) & MASK
        z = seed
        z = ((z ^ z >> 30) * 0xBF58476D1CE4E5B9) & MASK
        z = ((z ^ z >> 27) * 0x94D049BB133111EB) & MASK
        words.append(z ^ z >> 31)
    return tuple(words)


if __name__ == "__main__":
    matrix = [pack(step(unpack(1 << i))) for i in range(256)]
    for _ in range(128):
        matrix = square(matrix)
    jump = matrix
    for _ in range(64):
        matrix = square(matrix)
    long_jump = matrix
    print("# seed stage layer field, then the first four words of the stream")
    for seed, stage, layer, field in [
        (0, 0, 0, 0), (1, 0, 0, 0), (1, 0, 0, 1), (1, 0, 1, 0), (1, 1, 0, 0), (1, 2, 5, 2),
        (2**64 - 1, 1, 6, 1), (123456789, 3, 40, 15), (42, 0, 31, 0),
    ]:
        state = pack(splitmix(seed))
        for _ in range(stage):
            state = apply(long_jump, state)
        for _ in range(16 * layer + field):
            state = apply(jump, state)
        state, words = unpack(state), []
        for _ in range(4):
            words.append(output(state))
            state = step(state)
        print(seed, stage, layer, field, *words)
    print("# the authors' check: state 1 2 3 4")
    state = (1, 2, 3, 4)
    words = []
    for _ in range(10):
        words.append(output(state))
        state = step(state)
    print("#", *words)
