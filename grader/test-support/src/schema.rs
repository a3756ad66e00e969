//! Validation of reports against their published JSON schemas.
//!
//! Supports the keywords of JSON Schema 2020-12 that the schemas use, and fails on any other.

use serde_json::Value;

/// Validates `instance`; the error names the first place that does not fit `schema`, and the reason.
pub(super) fn validate(schema: &Value, instance: &Value) -> Result<(), String> {
    if let Some(keyword) = unknown_keyword(schema) {
        return Err(format!("the schema has the unknown keyword {keyword}"));
    }
    Validator { root: schema }.check(schema, instance, "")
}

/// The first keyword in the schema that this module does not support.
fn unknown_keyword(schema: &Value) -> Option<&str> {
    schema.as_object()?.iter().find_map(|(keyword, value)| match keyword.as_str() {
        "properties" | "$defs" => value.as_object()?.values().find_map(unknown_keyword),
        "anyOf" | "oneOf" | "prefixItems" => list(value).iter().find_map(unknown_keyword),
        "items" | "additionalProperties" => unknown_keyword(value),
        "$schema" | "title" | "description" | "$ref" | "type" | "format" | "const" | "minimum"
        | "minItems" | "maxItems" | "required" => None,
        unknown => Some(unknown),
    })
}

struct Validator<'a> {
    root: &'a Value,
}

impl Validator<'_> {
    fn check(&self, schema: &Value, instance: &Value, at: &str) -> Result<(), String> {
        let keywords = match schema {
            Value::Bool(true) => return Ok(()),
            Value::Object(keywords) => keywords,
            _ => return Err(format!("{at}: {schema} allows nothing")),
        };
        keywords
            .iter()
            .try_for_each(|(keyword, value)| self.keyword(keyword, value, schema, instance, at))
    }

    fn keyword(
        &self,
        keyword: &str,
        value: &Value,
        schema: &Value,
        instance: &Value,
        at: &str,
    ) -> Result<(), String> {
        let fits = |schema: &Value| self.check(schema, instance, at).is_ok();
        let is_met = match keyword {
            "$ref" => {
                let path = value.as_str().and_then(|name| name.strip_prefix('#'));
                let found = path.and_then(|path| self.root.pointer(path));
                return self.check(found.ok_or(format!("no {value}"))?, instance, at);
            }
            "type" => match value {
                Value::Array(types) => types.iter().any(|ty| is_of_type(ty, instance)),
                ty => is_of_type(ty, instance),
            },
            "format" => match value.as_str() {
                Some("uint" | "uint32" | "uint64") => !instance.is_number() || instance.is_u64(),
                Some("int32") => {
                    !instance.is_number()
                        || instance.as_i64().is_some_and(|n| i32::try_from(n).is_ok())
                }
                Some("double") => !instance.is_number() || instance.as_f64().is_some(),
                _ => return Err(format!("{at}: unknown format {value}")),
            },
            "const" => instance == value,
            "minimum" => instance.as_f64().is_none_or(|number| Some(number) >= value.as_f64()),
            "minItems" => length(instance).is_none_or(|length| Some(length) >= value.as_u64()),
            "maxItems" => length(instance).is_none_or(|length| Some(length) <= value.as_u64()),
            "anyOf" => list(value).iter().any(fits),
            "oneOf" => list(value).iter().filter(|schema| fits(schema)).count() == 1,
            "required" => instance.as_object().is_none_or(|object| {
                list(value)
                    .iter()
                    .all(|name| object.contains_key(name.as_str().unwrap_or_default()))
            }),
            "properties" | "additionalProperties" => {
                let listed = &schema["properties"];
                for (name, member) in instance.as_object().into_iter().flatten() {
                    let schema = match keyword {
                        "properties" => value.get(name),
                        _ => listed.get(name).is_none().then_some(value),
                    };
                    if let Some(schema) = schema {
                        self.check(schema, member, &format!("{at}/{name}"))?;
                    }
                }
                true
            }
            "prefixItems" | "items" => {
                let first = list(&schema["prefixItems"]);
                for (index, item) in instance.as_array().into_iter().flatten().enumerate() {
                    let schema = match keyword {
                        "prefixItems" => first.get(index),
                        _ => (index >= first.len()).then_some(value),
                    };
                    if let Some(schema) = schema {
                        self.check(schema, item, &format!("{at}/{index}"))?;
                    }
                }
                true
            }
            // Annotations and definitions need no check.
            _ => true,
        };
        if is_met {
            Ok(())
        } else {
            Err(format!("{at}: {instance} does not fit {keyword} {value}"))
        }
    }
}

fn is_of_type(ty: &Value, instance: &Value) -> bool {
    match ty.as_str() {
        Some("null") => instance.is_null(),
        Some("boolean") => instance.is_boolean(),
        Some("integer") => instance.is_u64() || instance.is_i64(),
        Some("number") => instance.is_number(),
        Some("string") => instance.is_string(),
        Some("array") => instance.is_array(),
        Some("object") => instance.is_object(),
        _ => false,
    }
}

fn length(instance: &Value) -> Option<u64> {
    instance.as_array().map(|items| items.len() as u64)
}

fn list(value: &Value) -> &[Value] {
    value.as_array().map_or(&[], Vec::as_slice)
}

#[test]
fn invalid_documents_are_refused_by_place_and_keyword() {
    let schema = serde_json::json!({
        "type": "object",
        "properties": {
            "name": { "type": "string" },
            "count": { "type": "integer", "format": "uint", "minimum": 3 },
            "place": { "anyOf": [{ "$ref": "#/$defs/place" }, { "type": "null" }] },
            "kind": { "oneOf": [{ "const": "a" }, { "const": "b" }, { "type": "integer" }] },
            "pair": {
                "type": "array",
                "prefixItems": [{ "type": "number" }, { "type": "string" }],
                "minItems": 2,
                "maxItems": 2,
            },
            "list": { "type": ["array", "null"], "items": { "type": "boolean" } },
            "status": { "type": "integer", "format": "int32" },
        },
        "additionalProperties": { "type": "null" },
        "required": ["name"],
        "$defs": { "place": { "type": "array", "items": { "type": "number" } } },
    });
    let right = serde_json::json!({
        "name": "n", "count": 3, "place": [1.5, 2], "kind": "b", "pair": [0, ""], "list": [true], "more": null, "status": -1,
    });
    validate(&schema, &right).unwrap();
    validate(&schema, &serde_json::json!({ "name": "", "list": null, "place": null })).unwrap();
    for (member, value, reason) in [
        ("name", serde_json::json!(1), "/name: 1 does not fit type"),
        ("count", serde_json::json!(2), "/count: 2 does not fit minimum"),
        ("count", serde_json::json!(-4), "/count: -4 does not fit"),
        ("count", serde_json::json!(3.5), "/count: 3.5 does not fit"),
        ("place", serde_json::json!(["x"]), "/place: [\"x\"] does not fit anyOf"),
        ("kind", serde_json::json!("c"), "/kind: \"c\" does not fit oneOf"),
        ("pair", serde_json::json!([0]), "/pair: [0] does not fit minItems"),
        ("pair", serde_json::json!([0, "", 1]), "/pair: [0,\"\",1] does not fit maxItems"),
        ("pair", serde_json::json!([0, 1]), "/pair/1: 1 does not fit type"),
        ("list", serde_json::json!([true, 0]), "/list/1: 0 does not fit type"),
        ("status", serde_json::json!(1_u64 << 31), "/status: 2147483648 does not fit"),
        ("more", serde_json::json!(0), "/more: 0 does not fit type"),
    ] {
        let mut wrong = right.clone();
        wrong[member] = value;
        let told = validate(&schema, &wrong).unwrap_err();
        assert!(told.starts_with(reason), "{told}");
    }
    let told = validate(&schema, &serde_json::json!({})).unwrap_err();
    assert_eq!(told, ": {} does not fit required [\"name\"]");
    let unknown = serde_json::json!({
        "properties": { "absent": { "anyOf": [true, { "items": { "pattern": "x" } }] } },
    });
    let told = validate(&unknown, &right).unwrap_err();
    assert_eq!(told, "the schema has the unknown keyword pattern");
}
