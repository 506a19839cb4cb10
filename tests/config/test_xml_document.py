"""The hardened XML reader."""

from __future__ import annotations

import time

import pytest
from hypothesis import given
from hypothesis import strategies as st

from ddsi.config.xml_document import Element, parse_untrusted_xml
from ddsi.structure.errors import ConfigurationError


def parse(text: str) -> Element:
    root, rest = parse_untrusted_xml(text.encode(), "x.xml")
    assert rest == b""
    return root


def test_elements_know_their_line_their_attributes_and_their_text() -> None:
    text = '<?xml version="1.0"?>\n<!-- a <b> -->\n<a x="1">\n  <b> text &amp;\n more </b>\n  <c y="&lt;"/>\n</a>\n'
    root = parse(text)
    assert (root.name, root.line, root.attributes, root.text) == ("a", 3, {"x": "1"}, "")
    b, c = root.children
    assert (b.name, b.line, b.text) == ("b", 4, "text &\n more")
    assert (c.name, c.line, c.attributes) == ("c", 6, {"y": "<"})


def test_the_declared_encoding_is_used_unless_overridden() -> None:
    latin = '<?xml version="1.0" encoding="iso-8859-1"?><a>ä</a>'
    assert parse_untrusted_xml(latin.encode("latin-1"), "x")[0].text == "ä"
    assert parse_untrusted_xml(latin.encode(), "x", encoding="utf-8")[0].text == "ä"


def test_what_follows_the_root_is_handed_back() -> None:
    root, rest = parse_untrusted_xml(b"<a><b/></a> , <c/>", "x")
    assert root.name == "a"
    assert rest.strip() == b", <c/>"


class TestShortEndTags:
    """Cyclone's reader takes ``</>`` for any end tag, and its users write that."""

    @pytest.mark.parametrize(
        ("short", "long"),
        [
            ("<a><b>x</></>", "<a><b>x</b></a>"),
            ("<a>\n<b/><c>1</>\n</a>", "<a>\n<b/><c>1</c>\n</a>"),
            ("<a x='>'><b y=\"'>\"></></>", "<a x='>'><b y=\"'>\"></b></a>"),
            ("<a><!-- </> <z> --><![CDATA[</>]]><?p </>?></>", "<a><!-- --><![CDATA[</>]]></a>"),
        ],
    )
    def test_are_spelt_out(self, short: str, long: str) -> None:
        assert parse(short) == parse(long)

    @pytest.mark.parametrize(
        "text", ["</>", "<a></></>", "<a><b></>", "<a><!-- </>", '<a x="></>', "<a </>", '<a x="</>"></a>']
    )
    def test_do_not_hide_mistakes(self, text: str) -> None:
        with pytest.raises(ConfigurationError, match="not well-formed"):
            root, rest = parse_untrusted_xml(text.encode(), "x")
            raise ConfigurationError(f"not well-formed: {rest!r} is left") if rest else AssertionError(root)


class TestRefused:
    @pytest.mark.parametrize(
        "text",
        [
            "<!DOCTYPE a><a/>",
            '<!DOCTYPE a SYSTEM "http://example.org/x.dtd"><a/>',
            '<!DOCTYPE a [<!ENTITY b SYSTEM "file:///etc/passwd">]><a>&b;</a>',
            '<!DOCTYPE a [<!ENTITY b "bb"><!ENTITY c "&b;&b;">]><a>&c;</a>',
            '<!DOCTYPE a [<!ENTITY % p SYSTEM "file:///etc/passwd"> %p;]><a/>',
        ],
    )
    def test_document_types_and_so_all_entities(self, text: str) -> None:
        with pytest.raises(ConfigurationError, match=r"^x\.xml, line 1: a document type is not allowed here"):
            parse(text)

    def test_what_is_not_well_formed_with_line_and_column(self) -> None:
        with pytest.raises(ConfigurationError, match=r"^x\.xml, line 2, column 8: not well-formed XML: mismatched tag"):
            parse("<a>\n <b>1</c>\n</a>")

    def test_undeclared_entities(self) -> None:
        with pytest.raises(ConfigurationError, match="undefined entity"):
            parse("<a>&b;</a>")

    def test_deep_nesting(self) -> None:
        parse("<a>" * 40 + "</a>" * 40)
        with pytest.raises(ConfigurationError, match="line 1: nested deeper than 40 levels"):
            parse("<a>" * 41 + "</a>" * 41)

    def test_length(self) -> None:
        with pytest.raises(ConfigurationError, match="at most 1048576 are read"):
            parse("<a>" + " " * (1 << 20) + "</a>")

    @pytest.mark.parametrize("encoding", ["klingon", "shift_jis"])
    def test_encodings_that_cannot_be_read(self, encoding: str) -> None:
        with pytest.raises(ConfigurationError, match=r"^x\.xml"):
            parse(f'<?xml version="1.0" encoding="{encoding}"?><a>b</a>')


@pytest.mark.parametrize(
    "octets",
    [
        b"</>" + b"<a" * 500_000,
        b"</>" + b'<a"' * 300_000,
        b"<a></>" + b"<!--" * 250_000,
        b"<" + b"a" * 1_000_000 + b"</>",
        b"<a" + b" x" * 400_000 + b"</>",
        b"<a>" * 20 + b"</>" * 300_000,
    ],
    ids=range(6),
)
def test_hostile_documents_take_no_time(octets: bytes) -> None:
    began = time.perf_counter()
    with pytest.raises(ConfigurationError):
        parse_untrusted_xml(octets, "x", encoding="utf-8")
        raise ConfigurationError("junk after the root, which is the caller's to judge")
    assert time.perf_counter() - began < 2


_PIECES = [
    *("<a>", "</a>", "</>", "<b x='1'>", "<c/>", "<!--", "-->", "<![CDATA[", "]]>", "<?p", "?>", "<!DOCTYPE a [", "]>"),
    *("&lt;", "&x;", '"', "'", "<", ">", "x", "\n", "\0", "ä", "<?xml version='1.0' encoding='utf-16'?>"),
]


@given(
    st.lists(st.sampled_from(_PIECES), max_size=30).map("".join) | st.text(max_size=60),
    st.sampled_from([None, "utf-8"]),
)
def test_any_input_gives_a_tree_or_a_configuration_error(text: str, encoding: str | None) -> None:
    try:
        root, _rest = parse_untrusted_xml(text.encode("utf-8", "surrogatepass"), "x", encoding=encoding)
    except ConfigurationError:
        return
    assert root.line >= 1


@given(st.binary(max_size=60))
def test_any_octets_give_a_tree_or_a_configuration_error(octets: bytes) -> None:
    try:
        parse_untrusted_xml(octets, "x")
    except ConfigurationError:
        return
